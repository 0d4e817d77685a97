"""A question to the user at the terminal."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any


def at_the_terminal(said: str) -> bool:
    """Shows a question and waits for Enter, alone on its line and pressed after the question.
    Without a terminal there is no question."""
    shown = next(filter(_is_terminal, (sys.stderr, sys.stdout)), None)
    if shown is None or not _is_terminal(sys.stdin):
        return False
    _forget_typed()
    print(said, file=shown, flush=True)
    # Without Python's buffer, which may contain earlier input.
    return os.read(sys.stdin.fileno(), 1024) in (b"\n", b"\r", b"\r\n")


def _is_terminal(stream: Any) -> bool:
    with contextlib.suppress(AttributeError, OSError, ValueError):
        return bool(stream.isatty())
    return False


def _forget_typed() -> None:
    if sys.platform == "win32":
        import msvcrt

        while msvcrt.kbhit():
            msvcrt.getwch()
    else:
        import termios

        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
