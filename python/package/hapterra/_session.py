"""A session of ``hapterra run`` or ``demo``, which drives the device in a process of its own.

    Python ── commands (standard input) ──▶ hapterra run ═══ device
       ◀──────── events (a local socket) ──────┘

Python may hang, be stopped or be killed: nothing of the device waits for it, and the end of its
standard input ends the session as Ctrl-C does.
"""

from __future__ import annotations

import atexit
import collections
import contextlib
import json
import os
import socket
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Generic, TypeVar

from ._command import _INTERRUPT, _NEW_GROUP, CommandError, command, error

_T = TypeVar("_T")
#: The command says so where it cannot know that the board is disarmed, and where its guardian has
#: disarmed the board.
_NOT_CONFIRMED = "switch the amplifiers off"
_CONFIRMED = "the board has confirmed that it is disarmed"
#: For so long a board may take to confirm that it is disarmed, s; then once more with a signal.
_CONFIRMS_S = 20.0
#: Lines of the command that an error may quote.
_KEPT = 200


class DeviceError(CommandError):
    """A device that cannot be armed, has refused something, or has gone."""


class NotDisarmedError(DeviceError):
    """A session has ended, and the board has not confirmed that it is disarmed: switch the
    amplifiers off."""


class Buffer(Generic[_T]):
    """The newest items, dropping the oldest where nobody takes them."""

    def __init__(self, size: int) -> None:
        self._items: collections.deque[_T] = collections.deque(maxlen=size)
        self._changed = threading.Condition()
        self._open = True
        self.dropped = 0

    def put(self, item: _T) -> None:
        """Adds an item. Never waits for who takes them."""
        with self._changed:
            self.dropped += len(self._items) == self._items.maxlen
            self._items.append(item)
            self._changed.notify()

    def close(self) -> None:
        """Lets readers come to their end."""
        with self._changed:
            self._open = False
            self._changed.notify_all()

    def __iter__(self) -> Iterator[_T]:
        while True:
            with self._changed:
                while self._open and not self._items:
                    self._changed.wait(0.5)
                if not self._items:
                    return
                item = self._items.popleft()
            yield item


class Session:
    """The process, and what it has told so far.

    Parameters
    ----------
    words : the subcommand and its arguments.
    on_event : called with each event by the thread that reads them, and at last with one of the
        kind "over".
    """

    def __init__(self, words: Sequence[str], on_event: Callable[[dict[str, Any]], None]) -> None:
        self._on_event = on_event
        self._changed = threading.Condition()
        self._told: collections.deque[str] = collections.deque(maxlen=_KEPT)
        #: As the column ``mode`` of a recording.
        self.mode = "disarmed"
        self.fault: int | None = None
        #: The view in force, counted from 0.
        self.view = -1
        #: Number of the question that is open, its lines, and the one that was answered last.
        self.asks: int | None = None
        self.question: list[str] = []
        self.answered: int | None = None
        #: The last lines about arming.
        self.arming: list[str] = []
        self.refused: list[str] = []
        self.marks: list[dict[str, Any]] = []
        self._disarmed = False
        driven = ["--commands", "-", "--end-with-input", "--events", "0"]
        self._child = subprocess.Popen(
            [*command(), *words, *driven],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            bufsize=0,
            start_new_session=os.name == "posix",
            creationflags=_NEW_GROUP,
        )
        self._events: threading.Thread | None = None
        self._stderr = threading.Thread(target=self._read_stderr, daemon=True)
        self._stderr.start()
        _SESSIONS.add(self)

    def _read_stderr(self) -> None:
        """Passes on what the command says, but for figures and its error, which is raised."""
        assert self._child.stderr
        is_error = False
        for raw in self._child.stderr:
            line = raw.decode("utf-8", "replace").rstrip()
            if line.startswith("events         ") and self._events is None:
                host, _, port = line.split()[-1].rpartition(":")
                try:
                    stream = socket.create_connection((host, int(port)))
                except OSError:
                    # It has ended already, and says why.
                    continue
                self._events = threading.Thread(target=self._read, args=(stream,), daemon=True)
                self._events.start()
                continue
            self._told.append(line)
            is_error = is_error or line.startswith("error: ")
            if not (is_error or line.lstrip()[:1].isdigit()):
                print(f"hapterra: {line}", file=sys.stderr)
        if self._events is not None:
            self._events.join()
        self._on_event({"event": "over"})

    def _read(self, stream: socket.socket) -> None:
        # A process that is killed resets the line; its end is seen otherwise.
        with contextlib.suppress(OSError), stream, stream.makefile("rb") as lines:
            for line in lines:
                event = json.loads(line)
                self._take(event)
                self._on_event(event)

    def _take(self, event: dict[str, Any]) -> None:
        kind = event["event"]
        if kind in ("sample", "place", "contact", "material"):
            return
        with self._changed:
            if kind == "limits":
                self.mode, self.fault = event["mode"], event["fault"]
            elif kind == "view":
                self.view = event["view"]
            elif kind == "arming":
                self.arming = (self.arming + event["lines"])[-_KEPT:]
                self.question = event["lines"]
                self.asks = event["asks"] if event["asks"] != self.answered else None
            elif kind == "refused":
                self.refused.append(event["text"])
            elif kind == "mark":
                self.marks.append(event)
            elif kind == "end":
                self.mode, self._disarmed = "disarmed", event["disarmed"]
            self._changed.notify_all()

    @property
    def is_disarmed(self) -> bool:
        """Whether the board has confirmed, at the end, that it is disarmed."""
        told = any(_CONFIRMED in line for line in list(self._told))
        return self._disarmed or told or self._child.poll() == 0

    @property
    def is_over(self) -> bool:
        """Whether the command has ended, or is about to, and all of its events have been taken."""
        return not self._stderr.is_alive()

    def send(self, line: str) -> None:
        """Gives a command. Raises ValueError for what is not one line."""
        if not line.isprintable():
            raise ValueError(f"{line!r} has characters that no command can have")
        assert self._child.stdin
        try:
            self._child.stdin.write(f"{line}\n".encode())
        except OSError:
            raise self.error("the session is over") from None

    def wait(self, is_it: Callable[[], bool], timeout: float) -> bool:
        """Waits until something is so, the session is over, or for so many seconds. Returns
        whether it is so."""
        until = time.monotonic() + timeout
        with self._changed:
            while not is_it() and not self.is_over and time.monotonic() < until:
                # The end of the thread that notifies is not notified.
                self._changed.wait(min(0.1, until - time.monotonic()))
            return is_it()

    def error(self, message: str) -> DeviceError:
        """An error with what the command said of it: its own error, where it has ended with one."""
        told = list(self._told)
        if self.is_over and any(line.startswith("error: ") for line in told):
            own = error("\n".join(told), self._child.wait())
            return DeviceError(own.message, own.hint)
        reasons = self.arming[-8:] + self.refused[-1:]
        return DeviceError("\n".join([message, *reasons]))

    def end(self) -> None:
        """Ends the session as Ctrl-C does, and waits until the board has confirmed.

        Raises
        ------
        NotDisarmedError
            The board has not confirmed that it is disarmed.
        DeviceError
            The board is disarmed, and the command has failed.
        """
        assert self._child.stdin
        self._child.stdin.close()
        for _ in range(3):
            try:
                self._child.wait(_CONFIRMS_S)
                break
            # The second Ctrl-C ends the command at once, and its guardian disarms the board.
            except (KeyboardInterrupt, subprocess.TimeoutExpired):
                self._child.send_signal(_INTERRUPT)
        else:
            self._child.kill()
        code = self._child.wait()
        self._stderr.join(_CONFIRMS_S)
        _SESSIONS.discard(self)
        if not self.is_disarmed:
            told = "\n".join(self._told)
            # Where nothing was opened, nothing was armed.
            if self.view >= 0 or _NOT_CONFIRMED in told:
                message = "the board did not confirm that it is disarmed: " + _NOT_CONFIRMED
                raise NotDisarmedError(f"{message}\n{told}")
        if code:
            raise self.error(f"hapterra ended with exit code {code}")


#: Those that have not ended.
_SESSIONS: weakref.WeakSet[Session] = weakref.WeakSet()


@atexit.register
def _end_all() -> None:
    for session in list(_SESSIONS):
        try:
            session.end()
        except CommandError as why:
            print(f"hapterra: {why}", file=sys.stderr)


def _leave_to_parent() -> None:
    """A fork must not keep the input of a session open whose Python is killed."""
    for session in list(_SESSIONS):
        if session._child.stdin:
            session._child.stdin.close()
    _SESSIONS.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_parent)
