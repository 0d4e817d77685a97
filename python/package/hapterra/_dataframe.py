"""pandas, imported only for a DataFrame."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType


def pandas_for(name: str) -> ModuleType:
    """Returns pandas for a function called ``name``.

    Raises
    ------
    ImportError
        Without pandas, with the command to install it.
    """
    try:
        return import_module("pandas")
    except ImportError as error:
        raise ImportError(f"{name} returns a DataFrame: pip install pandas") from error
