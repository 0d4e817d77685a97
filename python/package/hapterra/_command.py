"""The command ``hapterra``: its arguments, and runs of it in a process of its own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable
from typing import Any, Union

Word = Union[str, "os.PathLike[str]"]

# In its own process group: a terminal's Ctrl-C would be a second signal, which ends the command at
# once.
if sys.platform == "win32":
    _INTERRUPT, _NEW_GROUP = signal.CTRL_BREAK_EVENT, subprocess.CREATE_NEW_PROCESS_GROUP
else:
    _INTERRUPT, _NEW_GROUP = signal.SIGINT, 0


class CommandError(Exception):
    """The command ``hapterra`` has failed."""

    #: The command's error message.
    message: str
    #: The command's hint; None if there is none.
    hint: str | None

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message if hint is None else f"{message}\nhint: {hint}")
        self.message = message
        self.hint = hint


def command() -> list[str]:
    """Returns the words that start the command: the environment variable HAPTERRA, else this
    package."""
    named = os.environ.get("HAPTERRA")
    return [named] if named else [sys.executable, "-m", "hapterra"]


def lab() -> list[str]:
    """Returns the words that start ``hapterra-lab``: the variable HAPTERRA_LAB, else the PATH's.

    Raises
    ------
    CommandError
        If it is not found.
    """
    named = os.environ.get("HAPTERRA_LAB") or shutil.which("hapterra-lab")
    if not named:
        raise CommandError(
            "there is no program hapterra-lab on the PATH",
            "in a clone: cargo install --locked --path bench --bin hapterra-lab; or name it in HAPTERRA_LAB",
        )
    return [named]


def options(**given: Any) -> list[str]:
    """Returns options of the command: ``friction=0.1`` is ``--friction=0.1``, ``[1, 2]`` is
    ``1,2``, True is a flag, and None or False is omitted."""
    return [
        f"--{name.replace('_', '-')}" + ("" if value is True else f"={_text(value)}")
        for name, value in given.items()
        if value is not None and value is not False
    ]


def reading_options(cache: Word | None = None, **reading: Any) -> list[str]:
    """Returns the command's options for an input: ``no_data=-9999`` is ``--input=no-data=-9999``,
    and ``gdal={"NAME": "VALUE"}`` is ``--input=gdal:NAME=VALUE``."""
    gdal = {f"gdal:{name}": value for name, value in reading.pop("gdal", {}).items()}
    named = {name.replace("_", "-"): value for name, value in reading.items()}
    return options(cache=cache) + [
        f"--input={name}={_text(value)}"
        for name, value in {**named, **gdal}.items()
        if value is not None
    ]


def _text(value: Any) -> str:
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    return ",".join(map(_text, value)) if isinstance(value, Iterable) else str(value)


def run(*words: Word, program: list[str] | None = None) -> str:
    """Runs the command, or another program, to its end and returns its output.

    Ctrl-C also ends the command, and waits for its end.

    Raises
    ------
    CommandError
        With the command's own text and hint.
    """
    with subprocess.Popen(
        [*(program or command()), *(os.fspath(word) for word in words)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        start_new_session=os.name == "posix",
        creationflags=_NEW_GROUP,
    ) as child:
        try:
            printed, stderr_text = child.communicate()
        except BaseException:
            child.send_signal(_INTERRUPT)
            child.communicate()
            raise
    if child.returncode:
        raise error(stderr_text, child.returncode)
    return printed


def error(stderr_text: str, code: int) -> CommandError:
    """Returns the error from the command's standard error and exit code."""
    before, found, text = f"\n{stderr_text}".rpartition("\nerror: ")
    if not found:
        return CommandError(f"hapterra ended with exit code {code}: {stderr_text.strip()}")
    message, _, hint = text.partition("\nhint: ")
    # After a wrong word the command prints its usage.
    message = message.partition("\n\nUsage: ")[0]
    return CommandError(message.strip(), hint.strip() or None)


def main() -> int:
    """Runs the command with the arguments of this process: ``hapterra`` in a terminal."""
    # The command handles Ctrl-C itself; until it does, Ctrl-C ends the process as usual.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from . import _native

    return _native.main(sys.argv[1:], [sys.executable, "-m", "hapterra"])
