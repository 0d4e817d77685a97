"""The command ``hapterra``: its words, and runs of it in a process of its own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable
from typing import Any, Union

Word = Union[str, "os.PathLike[str]"]

# In a group of its own: a terminal's Ctrl-C would be a second one, which ends the command at once.
if sys.platform == "win32":
    _INTERRUPT, _NEW_GROUP = signal.CTRL_BREAK_EVENT, subprocess.CREATE_NEW_PROCESS_GROUP
else:
    _INTERRUPT, _NEW_GROUP = signal.SIGINT, 0


class CommandError(Exception):
    """The command ``hapterra`` has failed."""

    #: What went wrong, in the command's words.
    message: str
    #: What to do about it; None where the command does not say.
    hint: str | None

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message if hint is None else f"{message}\nhint: {hint}")
        self.message = message
        self.hint = hint


def command() -> list[str]:
    """The words that start the command: the environment variable HAPTERRA, else this package."""
    named = os.environ.get("HAPTERRA")
    return [named] if named else [sys.executable, "-m", "hapterra"]


def lab() -> list[str]:
    """The words that start ``hapterra-lab``: the environment variable HAPTERRA_LAB, else that of the PATH.

    Raises
    ------
    CommandError
        Where there is none.
    """
    named = os.environ.get("HAPTERRA_LAB") or shutil.which("hapterra-lab")
    if not named:
        raise CommandError(
            "there is no program hapterra-lab on the PATH",
            "in a clone: cargo install --path bench --bin hapterra-lab; or name it in HAPTERRA_LAB",
        )
    return [named]


def options(**given: Any) -> list[str]:
    """Options of the command: ``friction=0.1`` is ``--friction=0.1``, ``[1, 2]`` is ``1,2``, True is a
    flag, and None or False is none."""
    return [
        f"--{name.replace('_', '-')}" + ("" if value is True else f"={_text(value)}")
        for name, value in given.items()
        if value is not None and value is not False
    ]


def reading_options(cache: Word | None = None, **reading: Any) -> list[str]:
    """Options of the command on an input: ``no_data=-9999`` is ``--input=no-data=-9999``, and
    ``gdal={"NAME": "VALUE"}`` is ``--input=gdal:NAME=VALUE``."""
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
    """Runs the command, or another program, to its end and returns what it prints.

    Ctrl-C ends the command, too, and waits for it.

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
            printed, told = child.communicate()
        except BaseException:
            child.send_signal(_INTERRUPT)
            child.communicate()
            raise
    if child.returncode:
        raise error(told, child.returncode)
    return printed


def error(told: str, code: int) -> CommandError:
    """The error that standard error and exit code of the command tell."""
    before, found, text = f"\n{told}".rpartition("\nerror: ")
    if not found:
        return CommandError(f"hapterra ended with exit code {code}: {told.strip()}")
    message, _, hint = text.partition("\nhint: ")
    # A wrong word is followed by how the command is used.
    message = message.partition("\n\nUsage: ")[0]
    return CommandError(message.strip(), hint.strip() or None)


def main() -> int:
    """Runs the command with the arguments of this process: ``hapterra`` in a terminal."""
    # It listens to Ctrl-C by itself, and ends as other programs do until then.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from . import _native

    return _native.main(sys.argv[1:], [sys.executable, "-m", "hapterra"])
