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
import queue
import re
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
#: Messages of the command: the board may not be disarmed; its guardian has disarmed the board.
_NOT_CONFIRMED = "switch the amplifiers off"
_CONFIRMED = "the board has confirmed that it is disarmed"
#: Time-out for the board to confirm that it is disarmed, s; used again after a signal.
_CONFIRM_TIMEOUT_S = 20.0
#: Time-out for the command's last lines after the board is disarmed, s: a viewer that still runs
#: keeps standard error open.
_STDERR_TIMEOUT_S = 1.0
#: Interval of checks for a change, s.
_POLL_INTERVAL_S = 0.02
#: Lines of the command that an error may quote.
_MAX_LINES = 200
#: Lines that are never passed on, and those that a quiet session does not pass on. A recording that
#: was cut is reported.
_FIGURE_LINE = re.compile(r"\s*\d")
_STATUS_LINE = re.compile(r"view \d|the view stays as it was|(?!recording)[a-z]+  ")


class DeviceError(CommandError):
    """A device that cannot be armed, has refused a request, or is disconnected."""


class NotDisarmedError(DeviceError):
    """The session has ended, and the board has not confirmed that it is disarmed: switch the
    amplifiers off."""


def refuse_in_fork(pid: int) -> None:
    """Refuses a fork's request to a session of its parent, whose state is unknown to the fork."""
    if os.getpid() != pid:
        raise DeviceError(
            "this process is a fork, and the arm is driven by the process that made it: disarm() there"
        )


class Buffer(Generic[_T]):
    """A queue of the newest items; drops the oldest if they are not read.

    One thread writes. It shares no lock of Python with the readers: Ctrl-C in a reader can leave
    such a lock held, and then no event of the session is handled any more.
    """

    def __init__(self, size: int) -> None:
        if size < 1:
            raise ValueError(f"buffer={size}: use a number of items from 1")
        self._items: queue.SimpleQueue[_T] = queue.SimpleQueue()
        self._size, self._open = size, True
        self.dropped = 0

    def put(self, item: _T) -> None:
        """Adds an item. Never waits for a reader."""
        while self._items.qsize() >= self._size:
            with contextlib.suppress(queue.Empty):
                self._items.get_nowait()
                self.dropped += 1
        self._items.put(item)

    def close(self) -> None:
        """Ends the iteration of readers after the last item."""
        self._open = False

    def __iter__(self) -> Iterator[_T]:
        while True:
            was_open = self._open
            try:
                item = self._items.get(timeout=_POLL_INTERVAL_S)
            except queue.Empty:
                if was_open:
                    continue
                return
            yield item


class Session:
    """The process, and its reported state.

    Parameters
    ----------
    words : the subcommand and its arguments.
    on_event : called with each event by the thread that reads them, and at last with one of the
        kind "over".
    is_quiet : pass on only instructions and warnings.
    """

    def __init__(
        self,
        words: Sequence[str],
        on_event: Callable[[dict[str, Any]], None],
        is_quiet: bool = False,
    ) -> None:
        self._on_event, self._is_quiet = on_event, is_quiet
        self._pid = os.getpid()
        self._lines: collections.deque[str] = collections.deque(maxlen=_MAX_LINES)
        #: As the column ``mode`` of a recording.
        self.mode = "disarmed"
        self.fault: int | None = None
        #: The current placement, counted from 0.
        self.view = -1
        #: Number of the open question and its lines; number of the last one that was fetched.
        self._question: tuple[int, list[str]] | None = None
        self._taken: int | None = None
        #: The last lines about arming.
        self.arming: list[str] = []
        self.refused: list[str] = []
        self.marks: list[dict[str, Any]] = []
        self._disarmed = False
        input_options = ["--commands", "-", "--end-with-input"]
        self._child = subprocess.Popen(
            [*command(), *words, *input_options],
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
        _end_with_main_thread()

    def _read_stderr(self) -> None:
        try:
            self._forward_stderr()
            if self._events is not None:
                self._events.join()
        finally:
            self._on_event({"event": "over"})

    def _forward_stderr(self) -> None:
        """Passes on the command's lines to its end, so that the command never waits for a
        reader."""
        assert self._child.stderr
        for raw in self._child.stderr:
            line = raw.decode("utf-8", "replace").rstrip()
            if line.startswith("events         ") and self._events is None:
                host, _, port = line.split()[-1].rpartition(":")
                try:
                    stream = socket.create_connection((host, int(port)))
                except (ConnectionError, ValueError):
                    # The command has ended already; its other lines report why.
                    continue
                except OSError:
                    # A session without a reader of its events must not arm.
                    self.close_input()
                    continue
                self._events = threading.Thread(target=self._read_events, args=(stream,), daemon=True)
                self._events.start()
                continue
            self._lines.append(line)
            self._disarmed = self._disarmed or line.endswith(_CONFIRMED)
            if not (_FIGURE_LINE.match(line) or self._is_quiet and _STATUS_LINE.match(line)):
                # A replacement of standard error may raise any exception.
                with contextlib.suppress(Exception):
                    print(f"hapterra: {line}", file=sys.stderr)

    def _read_events(self, stream: socket.socket) -> None:
        # A killed process resets the connection; its end is detected elsewhere.
        with contextlib.suppress(OSError), stream, stream.makefile("rb") as lines:
            for line in lines:
                # Its last line may be cut.
                with contextlib.suppress(ValueError):
                    event = json.loads(line)
                    self._handle_event(event)
                    self._on_event(event)

    def _handle_event(self, event: dict[str, Any]) -> None:
        kind = event["event"]
        if kind in ("place", "contact", "material"):
            return
        if kind == "sample" and (event["mode"], event["view"]) == (self.mode, self.view):
            return
        if kind == "sample":
            # Lines that reported a change may have been dropped.
            self.mode, self.view = event["mode"], event["view"]
        elif kind == "limits":
            self.mode, self.fault = event["mode"], event["fault"]
        elif kind == "view":
            self.view = event["view"]
        elif kind == "arming":
            self._handle_arming(event["lines"], event["asks"])
        elif kind == "refused":
            self.refused.append(event["text"])
        elif kind == "mark":
            self.marks.append(event)
        elif kind == "end":
            # The guardian may have confirmed it meanwhile.
            if event["disarmed"]:
                self.mode, self._disarmed = "disarmed", True

    def _handle_arming(self, lines: list[str], number: int | None) -> None:
        self.arming = (self.arming + lines)[-_MAX_LINES:]
        if number is None:
            self._question = None
            return
        before = self._question[1] if self._question and self._question[0] == number else []
        self._question = number, before + [line for line in lines if line not in before]

    @property
    def asks(self) -> bool:
        """Returns True if there is an open question that was not fetched."""
        question = self._question
        return question is not None and question[0] != self._taken

    def take_question(self) -> tuple[int, str] | None:
        """Returns the number and the lines of the open question, once."""
        question = self._question
        if question is None or question[0] == self._taken:
            return None
        self._taken = question[0]
        return question[0], "\n".join(question[1])

    @property
    def is_disarmed(self) -> bool:
        """Returns True if the board has confirmed, at the end, that it is disarmed."""
        # The exit code does not show it: it is also 0 for a child that other code has waited for.
        refuse_in_fork(self._pid)
        return self._disarmed

    @property
    def has_ended(self) -> bool:
        """Returns True if the command has ended, or is about to, and all its events were
        handled."""
        return not self._stderr.is_alive()

    def send(self, line: str) -> None:
        """Sends a command. Raises ValueError if it is not one line."""
        if not line.isprintable():
            raise ValueError(f"{line!r} has characters that no command can have")
        refuse_in_fork(self._pid)
        assert self._child.stdin
        try:
            self._child.stdin.write(f"{line}\n".encode())
        except (OSError, ValueError):
            raise self.error("the session is over") from None

    def close_input(self) -> None:
        """Requests the end, as Ctrl-C does, without a wait."""
        if self._child.stdin:
            self._child.stdin.close()

    def wait(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Waits until ``condition()`` is true, the session is over, or ``timeout`` seconds have
        passed. Returns True if it is true."""
        # No lock: Ctrl-C could leave it held, and the thread that handles events would wait for it.
        until = time.monotonic() + timeout
        while not condition() and not self.has_ended and time.monotonic() < until:
            time.sleep(_POLL_INTERVAL_S)
        return condition()

    def error(self, message: str) -> DeviceError:
        """Returns an error with the command's lines, or the command's own error if it ended with
        one."""
        lines = list(self._lines)
        has_ended = self.has_ended or self._child.returncode is not None
        if has_ended and any(line.startswith("error: ") for line in lines):
            failure = error("\n".join(lines), self._child.wait())
            return DeviceError(failure.message, failure.hint)
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
        refuse_in_fork(self._pid)
        self.close_input()
        for _ in range(3):
            try:
                self._child.wait(_CONFIRM_TIMEOUT_S)
                break
            # The second Ctrl-C ends the command at once, and its guardian disarms the board.
            except (KeyboardInterrupt, subprocess.TimeoutExpired):
                self._child.send_signal(_INTERRUPT)
        else:
            self._child.kill()
        code = self._child.wait()
        self.wait(lambda: self.is_disarmed, _CONFIRM_TIMEOUT_S)
        self._stderr.join(_STDERR_TIMEOUT_S)
        self._on_event({"event": "over"})
        _SESSIONS.discard(self)
        if not self.is_disarmed:
            lines = "\n".join(self._lines)
            # If nothing was opened, nothing was armed.
            if self.view >= 0 or _NOT_CONFIRMED in lines:
                message = "the board did not confirm that it is disarmed: " + _NOT_CONFIRMED
                raise NotDisarmedError(f"{message}\n{lines}")
        if code:
            raise self.error(f"hapterra ended with exit code {code}")


#: Sessions that have not ended.
_SESSIONS: weakref.WeakSet[Session] = weakref.WeakSet()
#: The process in which a thread waits for the end of the main thread.
_watched_pid: int | None = None


def _close_inputs() -> None:
    for session in list(_SESSIONS):
        session.close_input()


def _end_with_main_thread() -> None:
    """Requests the end of all sessions when the main thread ends: Python waits for its other
    threads, which may read samples, before it calls the functions registered by atexit."""
    global _watched_pid

    def wait() -> None:
        threading.main_thread().join()
        _close_inputs()

    if _watched_pid != os.getpid():
        _watched_pid = os.getpid()
        threading.Thread(target=wait, daemon=True).start()


@atexit.register
def _end_all() -> None:
    _close_inputs()
    for session in list(_SESSIONS):
        try:
            session.end()
        except CommandError as why:
            print(f"hapterra: {why}", file=sys.stderr)


def _leave_to_parent() -> None:
    """Closes the sessions' inputs in a fork, which would keep them open if the parent is killed."""
    _close_inputs()
    _SESSIONS.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_parent)
