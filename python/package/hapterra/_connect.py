"""An arm, a virtual one or an emulated board, driven from Python."""

from __future__ import annotations

import functools
import json
import os
import shutil
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Union

from ._command import options as options_of
from ._native import Surface
from ._params import Params
from ._session import Buffer, DeviceError, NotDisarmedError, Session, refuse_in_fork
from ._terminal import ask_at_terminal
from ._terrain import Terrain

_Path = Union[str, "os.PathLike[str]"]
_Vector = tuple[float, float, float]
#: Time-out of a command, s: the clutch opens and closes in a second.
_COMMAND_TIMEOUT_S = 15.0
#: Parameters of ``Surface`` that are options of the command; the others are in its file.
_OPTIONS = ("stiffness", "max_force")
#: Commands that do not change the placement, or that change the surface, and their replacements.
_REPLACEMENTS = {
    **dict.fromkeys(
        ("surface", "stiffness", "friction", "viscous-friction", "damping", "shading", "texture"),
        "set it by device.params",
    ),
    "mark": "use device.mark()",
    "enter": "device.arm() asks and answers",
    "at": "each command is done at once",
    "on": "there is one device",
}


def _write_surface(surface: dict[str, Any], path: Path) -> Path:
    """Writes a surface as a file of the command."""
    scene = {"shading": surface["shading"]}
    default = {name: value for name, value in surface.items() if name not in ("shading", *_OPTIONS)}
    lines = [*_toml(scene), "[default]", *_toml(default)]
    path.write_text("\n".join(lines) + "\n")
    return path


def _toml(values: dict[str, Any]) -> list[str]:
    return [f"{name} = {json.dumps(value)}" for name, value in values.items()]


class Sample(NamedTuple):
    """Record of a tick. Vectors are east, north, up, in the placement's millimetres."""

    #: The device's number of the tick.
    tick: int
    #: Its time since the session began, s.
    t_s: float
    #: The haptic interface point, mm: the tip of the arm.
    hip_mm: _Vector
    #: The proxy, mm; the HIP without contact.
    proxy_mm: _Vector
    #: Force on the hand, N.
    force_n: _Vector
    #: "free", "touching", "releasing" or "unseeded", as in recordings.
    state: str
    #: Progress of arming: "disarmed", "requested", "confirming", "ramping", "armed", "fading".
    mode: str
    #: Number of the placement, from 0: each change of the surface or the placement increments it.
    view: int


class Mark(NamedTuple):
    """A marked moment."""

    text: str
    #: The marked tick, in which the device's mark pin rose.
    tick: int
    #: Time of that tick, s, as ``Sample.t_s``.
    t_s: float
    #: This computer's clock at the request of the mark, seconds since 1970, as ``time.time()``.
    host_unix_s: float


def connect(
    device: str = "usb",
    *,
    record: _Path | None = None,
    sample_every: int = 1,
    buffer: int = 60_000,
    quiet: bool = False,
    **options: Any,
) -> Device:
    """Returns a device, on which a terrain can be loaded and the arm armed.

    A person's hand is in an arm: read docs/safety.md first. The device is driven by the command
    ``hapterra`` in a process of its own, so the arm never waits for Python.

    Parameters
    ----------
    device : "usb", "usb:SERIAL", "tcp:HOST:PORT", "native" or "emulated"
        An arm's board; or without hardware the device's own program, compiled for this machine
        ("native", in real time) or on a board in QEMU ("emulated", at QEMU's speed), with a
        virtual arm in a scripted hand that tours the terrain once.
    record : path, optional
        File for the recording: CSV, or Parquet if its name ends in .parquet.
    sample_every : int
        ``samples()`` returns every N-th of the thousand samples a second.
    buffer : int
        Size of the queues of samples and of events; if one is full, its oldest item is dropped.
    quiet : bool
        Pass on only instructions and warnings, for an experiment in which the person must not
        read which surface it is.
    options
        Options of ``hapterra run`` (``hapterra demo`` for "emulated") with underscores:
        ``silence="10s"``, ``view=True``, ``settings="none"``.
    """
    return Device(device, record, sample_every, buffer, quiet, options)


class Device:
    """A device of ``connect``. Use it with ``with``: its end disarms the arm.

    It belongs to the process that created it: a fork can neither arm nor disarm it.
    """

    def __init__(
        self,
        name: str,
        record: _Path | None,
        every: int,
        buffer: int,
        quiet: bool,
        options: dict[str, Any],
    ) -> None:
        kinds = ("usb", "native", "emulated")
        if name not in kinds and not name.startswith(("usb:", "tcp:", "emulated:")):
            known = '"usb", "usb:SERIAL", "tcp:HOST:PORT", "native", "emulated" or "emulated:ELF"'
            raise ValueError(f"{name!r} is no device: use {known}")
        if name.startswith("emulated") and record is not None and Path(record).suffix == ".parquet":
            raise ValueError("an emulated board records CSV: name a file that ends in .csv")
        self.name = name
        self._record = None if record is None else Path(record)
        self._is_emulated = name.startswith("emulated")
        self._every, self._buffer, self._options = int(every), buffer, options
        self._quiet = quiet
        self._loaded: list[str] | None = None
        self._surface: dict[str, Any] = {}
        self._session: Session | None = None
        #: The touched surface; None for a parameter whose change was not confirmed.
        self._current_surface: dict[str, Any] = {}
        self._samples: Buffer[Sample] = Buffer(buffer)
        self._events: Buffer[dict[str, Any]] = Buffer(buffer)
        self._confirmed = False
        #: Error if the last session was not confirmed to be disarmed, else None.
        self._unconfirmed: str | None = None
        self._ending, self._changing, self._marking = (threading.RLock() for _ in range(3))
        self._pid = os.getpid()
        self._folder = tempfile.mkdtemp(prefix="hapterra-")
        self._remove_folder = weakref.finalize(self, _remove, self._folder, self._pid)
        self._detach_finalizer: Callable[[], object] | None = None

    def load(
        self, terrain: Terrain | _Path, surface: Surface | _Path | None = None, **options: Any
    ) -> None:
        """Sets the terrain and the surface of the next session.

        Parameters
        ----------
        terrain : a Terrain, or a source that ``hapterra run`` opens: a file, a folder, a URL. A
        Terrain
            is written to a file of 8 bytes a sample; pass the path of a large one.
        surface : Surface, or one of the command: "ice", "sand", "rock" or a file, optional
            Materials of a surface cannot be loaded: pass ``materials=``, a file, and the file of
            its classes as the surface.
        options
            Options of ``hapterra run`` with underscores: ``at=(x, y)``, ``scale="5m/mm"``,
            ``exaggeration="auto"``, ``tip="2mm"``, ``duration="60s"``. A Terrain has its own
            scale. If neither ``tip=`` nor ``Terrain.with_tip`` sets a radius, the tip is the ball
            that ``hapterra run`` chooses, while ``Contact`` has a point.
        """
        if self._session is not None:
            raise DeviceError("a terrain is touched: disarm() before another is loaded")
        if "device" in options:
            raise ValueError("load() accepts no device=: the device is that of connect()")
        words: dict[str, Any] = {}
        if isinstance(terrain, Terrain):
            file, words = terrain._write(Path(self._folder) / "terrain.npy")
        else:
            file = os.fspath(terrain)
        parameters = surface if isinstance(surface, Surface) else Surface()
        self._surface = parameters.params()
        if self._surface.pop("materials"):
            raise ValueError(
                "materials of a surface cannot be loaded: pass materials=, a file, and the file of"
                " its classes as the surface"
            )
        if isinstance(surface, Surface):
            words.update((name, self._surface[name]) for name in _OPTIONS)
            words["surface"] = _write_surface(self._surface, Path(self._folder) / "surface.toml")
        elif surface is not None:
            words["surface"] = surface
            self._surface = dict.fromkeys(self._surface)
        words.update(options)
        given = {name: value for name, value in options.items() if value is not None}
        if "friction" in given:
            self._surface["static_friction"] = given["friction"]
        self._surface.update(given)
        self._loaded = [file, *options_of(**words)]

    def arm(self, timeout: float = 120.0, ask: Callable[[str], bool] | None = None) -> None:
        """Serves the terrain and arms the arm. The user presses the dead-man switch: instructions
        are on standard error. Returns when the force is fully ramped up.

        Parameters
        ----------
        timeout : seconds, from the last answer.
        ask : called with the user's task or check before the arm is zeroed, or before a fault is
            cleared. True continues. Without ``ask``, Enter at the terminal continues, if it was
            pressed after the question was shown and nothing was typed before it.

        Raises
        ------
        DeviceError
            With the reason why it is not armed. The session is then over, and the board disarmed.
        """
        if self._loaded is None:
            raise DeviceError("there is nothing to touch: load() a terrain first")
        refuse_in_fork(self._pid)
        session = self._session or self._begin()
        until = time.monotonic() + timeout

        def is_armed_or_asked() -> bool:
            return session.mode == "armed" or session.asks

        try:
            while session.wait(is_armed_or_asked, until - time.monotonic()) and session.mode != "armed":
                question = session.take_question()
                if question is None:
                    continue
                number, text = question
                if not (ask or ask_at_terminal)(text):
                    hint = "" if ask else " by Enter at a terminal: elsewhere pass arm() an ask="
                    raise session.error(f"not armed: the question was not answered{hint}")
                session.send(f"enter {number}")
                until = time.monotonic() + timeout
            if session.mode != "armed":
                reason = "the session is over" if session.has_ended else f"not after {timeout:g} s"
                raise session.error(f"the arm is not armed: {reason}")
        except BaseException as why:
            self._end(why)
            raise

    def _begin(self) -> Session:
        out = Path(self._folder) / "demo"
        words = ["run", "--device", self.name]
        if self._is_emulated:
            words = ["demo", "--device", self.name, "--out", str(out)]
        elif self._record is not None:
            words += ["--out", str(self._record)]
        assert self._loaded is not None
        words += [*self._loaded, *options_of(**self._options), "--events", f"0,{self._every}"]
        self._confirmed = False
        self._samples, self._events = Buffer(self._buffer), Buffer(self._buffer)
        on_event = functools.partial(_sort_event, self._samples, self._events)
        self._current_surface = dict(self._surface)
        # A device without references, such as one that a notebook has replaced, ends its session.
        self._session = session = Session(words, on_event, self._quiet)
        self._detach_finalizer = weakref.finalize(self, session.close_input).detach
        return session

    def disarm(self) -> None:
        """Ends the session. Returns when the board has confirmed that it is disarmed.

        Raises
        ------
        NotDisarmedError
            The board has not confirmed it: switch the amplifiers off.
        DeviceError
            The board is disarmed, and there was another failure, for example of the recording.
        """
        self._end(None)

    def _end(self, why: BaseException | None) -> None:
        refuse_in_fork(self._pid)
        with self._ending:
            if self._session is not None:
                self._end_session(self._session, why)
            elif self._unconfirmed is not None:
                raise NotDisarmedError(self._unconfirmed)

    def _end_session(self, session: Session, why: BaseException | None) -> None:
        error: DeviceError | None = None
        # After any other exception, such as by Ctrl-C, the session can be ended again.
        try:
            session.end()
        except DeviceError as raised:
            error = raised
        self._confirmed = session.is_disarmed
        if isinstance(error, NotDisarmedError):
            self._unconfirmed = str(error)
        elif self._confirmed:
            self._unconfirmed = None
        self._session = None
        if self._detach_finalizer is not None:
            self._detach_finalizer()
        made = list(Path(self._folder, "demo").glob("*.csv"))
        if error is None and self._record is not None and made:
            shutil.move(made[0], self._record)
        if error is not None and (why is None or not self._confirmed):
            raise error

    @property
    def is_armed(self) -> bool:
        """Returns True if the arm is armed by the last report."""
        refuse_in_fork(self._pid)
        session = self._session
        return session is not None and not session.has_ended and session.mode == "armed"

    @property
    def is_disarmed(self) -> bool:
        """Returns True if the board confirmed at the end of the last session that it is disarmed."""
        refuse_in_fork(self._pid)
        return self._session is None and self._confirmed

    @property
    def fault(self) -> int | None:
        """Number of the latched fault, as in ``hapterra status``; None without one."""
        return self._session.fault if self._session else None

    @property
    def params(self) -> Params:
        """The surface, which may be changed while it is touched."""
        self._require_session()
        return Params(self._change, self._current_surface, self._changing)

    @property
    def dropped(self) -> int:
        """Samples that were dropped since ``arm()``, because they were not read in time."""
        return self._samples.dropped

    def samples(self) -> Iterator[Sample]:
        """Iterates over the samples as they arrive, until the session is over, the oldest first."""
        return iter(self._samples)

    def events(self) -> Iterator[dict[str, Any]]:
        """Iterates over all events except samples, as they arrive: contact, place, material,
        limits; see docs/how-to/events.md."""
        return iter(self._events)

    def command(self, line: str) -> None:
        """Sends a command of ``hapterra run`` that changes the placement, such as "zoom 2" or
        "pan 5mm 0mm", and waits until it is done. Raises DeviceError if it is refused. "reset" sets
        ``params`` to the loaded values; commands of the surface are refused."""
        first = [*line.partition("#")[0].split(), ""][0]
        if first in _REPLACEMENTS:
            raise DeviceError(f"{line!r} is not accepted as a command: {_REPLACEMENTS[first]}")
        self._change(line, self._surface if first == "reset" else {})

    def _change(self, line: str, changed: dict[str, Any]) -> None:
        """Sends a command, and stores its changes of the surface when it is done."""
        session = self._require_session()
        with self._changing:
            before, surface = dict(self._current_surface), self._current_surface
            view, refused = session.view, len(session.refused)
            # Until the command is confirmed, the parameter is unknown: the change may still be
            # made.
            surface.update(dict.fromkeys(changed))
            try:
                session.send(line)
            except ValueError:
                surface.update(before)
                raise
            done = session.wait(
                lambda: session.view != view or len(session.refused) > refused, _COMMAND_TIMEOUT_S
            )
            if len(session.refused) > refused:
                surface.update(before)
                raise DeviceError(session.refused[-1])
            if not done:
                raise session.error(
                    f"{line!r} is not done after {_COMMAND_TIMEOUT_S:g} s; the change may still come"
                )
            surface.update(changed)

    def mark(self, text: str) -> Mark:
        """Marks the current moment, in the recording and on the board's mark pin.

        ``text`` has 1 to 200 characters, no control characters. Returns when the device has
        reported the marked tick.
        """
        session = self._require_session()
        text = text.strip()
        with self._marking:
            made, refused = len(session.marks), len(session.refused)

            def matching() -> list[dict[str, Any]]:
                return [mark for mark in session.marks[made:] if mark["text"] == text]

            session.send(f"mark {text}")
            session.wait(lambda: bool(matching()) or len(session.refused) > refused, _COMMAND_TIMEOUT_S)
            mark = [*matching(), {}][0]
        if not mark and len(session.refused) > refused:
            raise DeviceError(session.refused[-1])
        if mark.get("marked_tick") is None:
            raise session.error(f"the device has not reported which tick {text!r} marks")
        return Mark(text, mark["marked_tick"], mark["marked_t_s"], mark["host_unix_s"])

    def _require_session(self) -> Session:
        if self._session is None:
            raise DeviceError("nothing is touched: arm() first")
        return self._session

    def __enter__(self) -> Device:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        why: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self._end(why)
        finally:
            self._remove_folder()

    def __repr__(self) -> str:
        mode = self._session.mode if self._session else "not served"
        return f"<Device {self.name!r}, {mode}>"


def _sort_event(samples: Buffer[Sample], events: Buffer[dict[str, Any]], event: dict[str, Any]) -> None:
    """Adds an event to its queue. Has no reference to the device, so that it can be collected."""
    kind = event["event"]
    if kind == "over":
        samples.close()
        events.close()
    elif kind != "sample":
        events.put(event)
    else:
        hip, proxy, force = (tuple(event[name]) for name in ("hip_mm", "proxy_mm", "force_n"))
        rest = (event[name] for name in ("state", "mode", "view"))
        samples.put(Sample(event["tick"], event["t_s"], hip, proxy, force, *rest))


def _remove(folder: str, pid: int) -> None:
    """Removes the temporary folder of a device. A fork must not remove its parent's."""
    if os.getpid() == pid:
        shutil.rmtree(folder, ignore_errors=True)
