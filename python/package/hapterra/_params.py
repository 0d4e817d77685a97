"""The surface while it is touched."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from ._session import DeviceError


class Params:
    """The surface while it is touched: ``device.params.friction = 0.2``.

    stiffness, N/mm; friction and static_friction; viscous_friction, s; damping, N·s/m; shading,
    "none" or "smooth"; texture, "none", ("grain", AMPLITUDE, WAVELENGTH) or ("grating", AMPLITUDE,
    WAVELENGTH, DIRECTION), mm and degrees. Setting one returns when the surface has changed; the
    force then turns to that of the new surface over half a second. If the device refuses a value,
    a DeviceError is raised and the surface is unchanged. Setting friction also sets
    static_friction. A change that is not confirmed in time may still take effect: its value is
    unknown then, and reading it raises a DeviceError, until it is set again. Stiffness is set by
    its ratio to the value before, so an unknown one requires ``device.command("reset")``.
    """

    stiffness: float
    friction: float
    static_friction: float
    viscous_friction: float
    damping: float
    shading: str
    texture: Any

    def __init__(
        self,
        change: Callable[[str, dict[str, Any]], None],
        surface: dict[str, Any],
        changing: AbstractContextManager[Any],
    ) -> None:
        self.__dict__.update(_change=change, _surface=surface, _changing=changing)

    def __getattr__(self, name: str) -> Any:
        if name not in type(self).__annotations__:
            raise AttributeError(f"a surface has no {name}")
        return self._known(name)

    def _known(self, name: str) -> Any:
        value = self.__dict__["_surface"][name]
        if value is None:
            reset = 'device.command("reset") restores the loaded surface'
            raise DeviceError(f"{name} is unknown, as its last change was not confirmed: {reset}")
        return value

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in type(self).__annotations__:
            raise AttributeError(f"{name} cannot be set while it is touched: load() it")
        # A parameter that is set by a ratio must not change meanwhile.
        with self.__dict__["_changing"]:
            self._set(name, value)

    def _set(self, name: str, value: Any) -> None:
        words = value if isinstance(value, (tuple, list)) else (value,)
        changed, option = {name: value}, name.replace("_", "-")
        if name == "stiffness":
            words = (float(value) / self._known(name),)
        elif name == "friction":
            changed = {"friction": words[0], "static_friction": words[-1]}
        elif name == "static_friction":
            option, words = "friction", (self._known("friction"), value)
        self.__dict__["_change"](" ".join([option, *map(_word, words)]), changed)

    def __repr__(self) -> str:
        surface = self.__dict__["_surface"]
        each = (f"{name}={surface[name]!r}" for name in type(self).__annotations__)
        return f"Params({', '.join(each)})"


def _word(value: Any) -> str:
    return repr(float(value)) if isinstance(value, (float, int, np.number)) else str(value)
