"""An arm, a virtual one or an emulated board, driven from Python."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Union

import numpy as np

from ._command import options as options_of
from ._native import Surface
from ._session import Buffer, DeviceError, Session
from ._terrain import Terrain

_Path = Union[str, "os.PathLike[str]"]
_Vector = tuple[float, float, float]
#: For so long a command may take until it is done: the clutch opens and closes in a second.
_DONE_S = 15.0
#: The command's options by the parameters of ``Surface``.
_OPTIONS = {
    "stiffness": "stiffness_n_per_mm",
    "max_force": "max_force_n",
    "damping": "damping_ns_per_m",
}


class Sample(NamedTuple):
    """What the loop did in a tick. Vectors are east, north, up, in the view's millimetres."""

    #: The device's number of the tick.
    tick: int
    #: Its time since the session began, s.
    t_s: float
    #: The haptic interface point, mm: the tip of the arm.
    hip_mm: _Vector
    #: The proxy, mm; the HIP where nothing is touched.
    proxy_mm: _Vector
    #: Force on the hand, N.
    force_n: _Vector
    #: "free", "touching", "letting go" or "waiting", as in recordings.
    state: str
    #: How far arming has come: "disarmed", "requested", "confirming", "ramping", "armed", "fading".
    mode: str
    #: The view, counted from 0: each change of the surface or the place makes another.
    view: int


class Mark(NamedTuple):
    """A moment that was marked."""

    text: str
    #: The tick that the device marked; its mark pin rose in it.
    tick: int
    #: Time of that tick, s, as ``Sample.t_s``.
    t_s: float
    #: This computer's clock when the mark was asked for, seconds since 1970, as ``time.time()``.
    host_unix_s: float


class Params:
    """The surface while it is touched: ``device.params.friction = 0.2``.

    stiffness, N/mm; friction and static_friction; viscous_friction, s; damping, N·s/m; shading,
    "none" or "smooth"; texture, "none", ("grain", AMPLITUDE, WAVELENGTH) or ("grating", AMPLITUDE,
    WAVELENGTH, DIRECTION), mm and degrees. Setting one returns once the force has gone out and
    the surface has changed; the force then comes in over half a second. What the device refuses is
    a DeviceError, and the surface stays as it was. Setting friction sets static_friction, too.
    """

    stiffness: float
    friction: float
    static_friction: float
    viscous_friction: float
    damping: float
    shading: str
    texture: Any

    def __init__(self, command: Callable[[str], None], surface: dict[str, Any]) -> None:
        self.__dict__.update(surface, _command=command)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in type(self).__annotations__:
            raise AttributeError(f"{name} cannot be set while it is touched: load() it")
        now = self.__dict__
        words = value if isinstance(value, (tuple, list)) else (value,)
        if name == "stiffness":
            words = (float(value) / now["stiffness"],)
        elif name == "static_friction":
            name, words = "friction", (now["friction"], value)
        line = [name.replace("_", "-"), *map(_word, words)]
        now["_command"](" ".join(line))
        if name == "friction":
            now.update(friction=words[0], static_friction=words[-1])
        else:
            now[name] = value

    def __repr__(self) -> str:
        each = (f"{name}={self.__dict__[name]!r}" for name in type(self).__annotations__)
        return f"Params({', '.join(each)})"


def connect(
    device: str = "usb",
    *,
    record: _Path | None = None,
    sample_every: int = 1,
    buffer: int = 60_000,
    **options: Any,
) -> Device:
    """A device, to load a terrain on and arm.

    A person's hand is in an arm: read docs/safety.md first. The device is driven by the command
    ``hapterra`` in a process of its own, so whatever Python does holds no arm up.

    Parameters
    ----------
    device : "usb", "usb:SERIAL", "tcp:HOST:PORT", "native" or "emulated"
        An arm's board; or without hardware the device's own program, compiled for this machine
        ("native", in real time) or on a board in QEMU ("emulated", as fast as that is), with a
        virtual arm in a scripted hand that tours the terrain once.
    record : path, optional
        Where what is felt is recorded: CSV, or Parquet where it ends in .parquet.
    sample_every : int
        Every so many of the thousand samples a second one comes to ``samples()``.
    buffer : int
        Samples, and events, that wait to be taken; beyond them the oldest are dropped.
    options
        Options of ``hapterra run`` (``hapterra demo`` for "emulated") with underscores:
        ``silence_s=10``, ``image="board.elf"``, ``view=True``.
    """
    return Device(device, record, sample_every, buffer, options)


class Device:
    """A device of ``connect``. Use it with ``with``: its end disarms the arm."""

    def __init__(
        self, name: str, record: _Path | None, every: int, buffer: int, options: dict[str, Any]
    ) -> None:
        kinds = ("usb", "native", "emulated")
        if name not in kinds and not name.startswith(("usb:", "tcp:")):
            known = '"usb", "usb:SERIAL", "tcp:HOST:PORT", "native" or "emulated"'
            raise ValueError(f"{name!r} is no device: give {known}")
        if name == "emulated" and record is not None and Path(record).suffix == ".parquet":
            raise ValueError("an emulated board records CSV: name a file that ends in .csv")
        self.name = name
        self._record = None if record is None else Path(record)
        self._every, self._buffer, self._options = int(every), buffer, options
        self._loaded: list[str] | None = None
        self._surface: dict[str, Any] = {}
        self._session: Session | None = None
        self._params: Params | None = None
        self._samples: Buffer[Sample] = Buffer(buffer)
        self._events: Buffer[dict[str, Any]] = Buffer(buffer)
        self._folder = tempfile.TemporaryDirectory(prefix="hapterra-")
        self._confirmed = False

    def load(
        self, terrain: Terrain | _Path, surface: Surface | None = None, **options: Any
    ) -> None:
        """Says what is touched next.

        Parameters
        ----------
        terrain : a Terrain, or whatever ``hapterra run`` opens: a file, a folder, a URL. A Terrain
            is written to a file of 8 bytes a sample; give the path of a large one.
        surface : Surface, optional
            Materials of a surface cannot be loaded: give ``materials=`` and ``material_table=``.
        options
            Options of ``hapterra run`` with underscores: ``at=(x, y)``, ``ground_m_per_mm=5``,
            ``exaggeration="auto"``, ``tip="2mm"``, ``seconds=60``. A Terrain has its scale
            itself.
        """
        if self._session is not None:
            raise DeviceError("a terrain is touched: disarm() before another is loaded")
        words: dict[str, Any] = {}
        if isinstance(terrain, Terrain):
            file, words = terrain._write(Path(self._folder.name) / "terrain.npy")
        else:
            file = os.fspath(terrain)
        self._surface = (surface or Surface()).params()
        if self._surface.pop("materials"):
            raise ValueError(
                "materials of a surface cannot be loaded: give materials= and material_table=, files"
            )
        if surface is None:
            self._surface["static_friction"] = options.get("friction", 0.0)
        else:
            words.update((_OPTIONS.get(name, name), it) for name, it in self._surface.items())
        words.update(options)
        names = {option: name for name, option in _OPTIONS.items()}
        self._surface.update((names.get(name, name), it) for name, it in options.items())
        self._loaded = [file, *options_of(**words)]

    def arm(self, timeout: float = 120.0, ask: Callable[[str], bool] | None = None) -> None:
        """Serves the terrain and arms the arm. A person presses the dead-man switch: what there
        is to do is said on standard error. Returns when the force is in.

        Parameters
        ----------
        timeout : seconds, from the last answer on.
        ask : called with what the person has to do or to look at before the arm is zeroed, or
            before a fault is cleared. True goes on. Without it, Enter at the terminal does.

        Raises
        ------
        DeviceError
            Why it is not armed. The session is over then, and the board disarmed.
        """
        if self._loaded is None:
            raise DeviceError("there is nothing to touch: load() a terrain first")
        session = self._session or self._begin()
        until = time.monotonic() + timeout

        def is_news() -> bool:
            return session.mode == "armed" or session.asks is not None

        try:
            while session.wait(is_news, until - time.monotonic()) and session.mode != "armed":
                number, said = session.asks, "\n".join(session.question)
                session.asks, session.answered = None, number
                if not (ask or _at_the_terminal)(said):
                    raise session.error("not armed: the question was not answered with yes")
                session.send(f"enter {number}")
                until = time.monotonic() + timeout
            if session.mode != "armed":
                over = "the session is over" if session.is_over else f"not after {timeout:g} s"
                raise session.error(f"the arm is not armed: {over}")
        except BaseException as why:
            self._end(why)
            raise

    def _begin(self) -> Session:
        out = Path(self._folder.name) / "demo"
        words = ["run", "--device", self.name]
        if self.name == "emulated":
            words = ["demo", "--device", "emulated", "--out", str(out)]
        elif self._record is not None:
            words += ["--record", str(self._record)]
        assert self._loaded is not None
        words += [*self._loaded, *options_of(**self._options), "--event-samples", str(self._every)]
        self._confirmed = False
        self._samples, self._events = Buffer(self._buffer), Buffer(self._buffer)
        self._session = session = Session(words, self._take)
        self._params = Params(self.command, dict(self._surface))
        return session

    def _take(self, event: dict[str, Any]) -> None:
        kind = event["event"]
        if kind == "over":
            self._samples.close()
            self._events.close()
        elif kind != "sample":
            self._events.put(event)
        else:
            hip, proxy, force = (tuple(event[name]) for name in ("hip_mm", "proxy_mm", "force_n"))
            what = (event[name] for name in ("state", "mode", "view"))
            self._samples.put(Sample(event["tick"], event["t_s"], hip, proxy, force, *what))

    def disarm(self) -> None:
        """Ends the session. Returns when the board has confirmed that it is disarmed.

        Raises
        ------
        NotDisarmedError
            It has not: switch the amplifiers off.
        DeviceError
            The board is disarmed, and something else went wrong, as with the recording.
        """
        self._end(None)

    def _end(self, why: BaseException | None) -> None:
        session, self._session = self._session, None
        if session is None:
            return
        try:
            session.end()
            self._confirmed = True
            made = list(Path(self._folder.name, "demo").glob("*.csv"))
            if self._record is not None and made:
                shutil.move(made[0], self._record)
        except DeviceError as error:
            self._confirmed = session.is_disarmed
            if why is None or not self._confirmed:
                raise

    @property
    def is_armed(self) -> bool:
        """Whether the force is in, as far as is known."""
        session = self._session
        return session is not None and not session.is_over and session.mode == "armed"

    @property
    def is_disarmed(self) -> bool:
        """Whether the board has confirmed at the end of the last session that it is disarmed."""
        return self._session is None and self._confirmed

    @property
    def fault(self) -> int | None:
        """Number of the latched fault, as in ``hapterra status``; None without one."""
        return self._session.fault if self._session else None

    @property
    def params(self) -> Params:
        """The surface, which may be changed while it is touched."""
        self._serving()
        assert self._params is not None
        return self._params

    @property
    def dropped(self) -> int:
        """Samples that were dropped since ``arm()``, because nobody took them in time."""
        return self._samples.dropped

    def samples(self) -> Iterator[Sample]:
        """The samples as they come, until the session is over; the oldest that is kept first."""
        return iter(self._samples)

    def events(self) -> Iterator[dict[str, Any]]:
        """Events as they come, but for samples: contact, place, material, limits, as
        docs/events.md has them."""
        return iter(self._events)

    def command(self, line: str) -> None:
        """Gives a command of ``hapterra run`` that changes the view, as "zoom 2" or "pan 5 0", and
        waits until that is in force. Raises DeviceError where it is refused."""
        session = self._serving()
        view, refused = session.view, len(session.refused)
        session.send(line)
        done = session.wait(
            lambda: session.view != view or len(session.refused) > refused, _DONE_S
        )
        if len(session.refused) > refused:
            raise DeviceError(session.refused[-1])
        if not done:
            raise session.error(f"{line!r} is not done after {_DONE_S:g} s")

    def mark(self, text: str) -> Mark:
        """Marks this moment, in the recording and on the board's mark pin.

        ``text`` has 1 to 200 characters, no control characters. Returns once the device has said
        which tick it marked.
        """
        session = self._serving()
        text = text.strip()
        made, refused = len(session.marks), len(session.refused)
        session.send(f"mark {text}")
        session.wait(lambda: len(session.marks) > made or len(session.refused) > refused, _DONE_S)
        if len(session.refused) > refused:
            raise DeviceError(session.refused[-1])
        mark = session.marks[-1] if len(session.marks) > made else {}
        if mark.get("marked_tick") is None:
            raise session.error(f"the device has not said which tick {text!r} marks")
        return Mark(text, mark["marked_tick"], mark["marked_t_s"], mark["host_unix_s"])

    def _serving(self) -> Session:
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
            self._folder.cleanup()

    def __repr__(self) -> str:
        mode = self._session.mode if self._session else "not served"
        return f"<Device {self.name!r}, {mode}>"


def _at_the_terminal(said: str) -> bool:
    """Enter at the terminal; nobody is asked where there is none."""
    if not sys.stdin.isatty():
        return False
    input()
    return True


def _word(value: Any) -> str:
    return repr(float(value)) if isinstance(value, (float, int, np.number)) else str(value)
