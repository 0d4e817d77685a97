"""A question to the user at the terminal."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any


def ask_at_terminal(question: str) -> bool:
    """Shows a question and waits for Enter, alone on its line and pressed after the question.
    Without a terminal there is no question."""
    terminal = next(filter(_is_terminal, (sys.stderr, sys.stdout)), None)
    if terminal is None or not _is_terminal(sys.stdin):
        return False
    _discard_input()
    print(question, file=terminal, flush=True)
    # Without Python's buffer, which may contain earlier input.
    return os.read(sys.stdin.fileno(), 1024) in (b"\n", b"\r", b"\r\n")


def _is_terminal(stream: Any) -> bool:
    with contextlib.suppress(AttributeError, OSError, ValueError):
        return bool(stream.isatty())
    return False


def _discard_input() -> None:
    if sys.platform == "win32":
        import msvcrt

        while msvcrt.kbhit():
            msvcrt.getwch()
    else:
        import termios

        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
