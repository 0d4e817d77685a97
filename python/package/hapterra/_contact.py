"""Contacts and their steps."""

from __future__ import annotations

import enum
import warnings
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _native
from ._dataframe import pandas_for
from ._native import Surface
from ._terrain import Terrain

if TYPE_CHECKING:
    import pandas

#: A row of ``Contact.run``. Vectors are east, north, up; ``state`` is a number of ``State``.
STEP = np.dtype(
    [
        ("t_s", "=f8"),
        ("hip_mm", "=f8", (3,)),
        ("proxy_mm", "=f8", (3,)),
        ("force_n", "=f4", (3,)),
        ("state", "u1"),
    ],
    align=True,
)


class State(enum.IntEnum):
    """The state of a proxy."""

    #: The HIP is in the air, and so is the proxy: no force.
    FREE = 0
    #: The proxy is on the surface, and the HIP below it.
    TOUCHING = 1
    #: The surface under the proxy has ended, and the last force ramps down.
    RELEASING = 2
    #: The HIP is below the surface and has not been above it yet: no force until then.
    BELOW_GROUND = 3
    #: The HIP is in a no-data area or outside, and has not been above the surface yet: no force.
    OUTSIDE = 4


_STATES = list(State)


class Step(NamedTuple):
    """The result of one step."""

    #: The force on the hand, N: east, north, up.
    force_n: tuple[float, float, float]
    #: The proxy, mm: on the surface during contact, else at the HIP.
    proxy_mm: tuple[float, float, float]
    #: State of the proxy.
    state: State
    #: The height of the surface over the HIP, mm, while the state is BELOW_GROUND.
    surface_mm: float | None


class StepError(ValueError):
    """A step of a path that was not possible; ``steps`` are those before it."""

    #: The steps before it, as ``Contact.run`` returns them; ``len(steps)`` is the row that failed.
    steps: npt.NDArray[np.void]

    def __init__(self, message: str, steps: npt.NDArray[np.void]) -> None:
        super().__init__(message)
        self.steps = steps


def arguments(path_mm: npt.ArrayLike, t: npt.ArrayLike | None) -> tuple[bytes, bytes | None]:
    """Returns a path and its times as arguments of the compiled part."""
    path = np.asarray(path_mm, "=f8")
    if path.ndim != 2 or path.shape[1] != 3:
        raise ValueError(f"the path has the shape {path.shape}: use (N, 3), east, north, up")
    times = None if t is None else np.asarray(t, "=f8")
    if times is not None and times.shape != path.shape[:1]:
        raise ValueError(f"t has the shape {times.shape}, and the path has {len(path)} rows")
    return path.tobytes(), None if times is None else times.tobytes()


class Contact:
    """A haptic interface point (HIP) and its proxy over a terrain.

    Parameters
    ----------
    terrain : Terrain
    surface : Surface, optional
        By default 0.5 N/mm without friction.
    rate : int
        Steps a second, 1000 to 10000 in whole thousands; damping and viscous friction use it.

    The first position should be above the terrain: a path that begins below it has the state
    BELOW_GROUND, and no force until the HIP has been above. A contact belongs to one hand: use
    one for each thread. A terrain may be shared.
    """

    def __init__(
        self, terrain: Terrain, surface: Surface | None = None, *, rate: int = 1000
    ) -> None:
        if not isinstance(terrain, Terrain):
            raise TypeError("the terrain is no hapterra.Terrain: Terrain(heights, cell_mm=)")
        self._native = _native.Contact(terrain._native, surface or Surface(), rate)
        self.terrain = terrain
        self.rate = rate

    def step(self, hip_mm: Iterable[float]) -> Step:
        """Makes one step with the HIP at a position: east, north, up, mm.

        Raises ValueError for an impossible position; the contact is then unchanged.
        """
        east, north, up = hip_mm
        force, proxy, state, surface = self._native.step(east, north, up)
        return Step(force, proxy, _STATES[state], surface)

    def run(self, path_mm: npt.ArrayLike, t: npt.ArrayLike | None = None) -> npt.NDArray[np.void]:
        """Makes a step for each tick of a path, without the interpreter's lock.

        Parameters
        ----------
        path_mm : array of shape (N, 3)
            East, north, up, mm.
        t : array of shape (N,), seconds, optional
            Without it each row is a tick. With it the path is sampled at ``rate``, by the rule of
            ``hapterra replay``: ticks begin at ``t[0]``; a row within a hundredth of a tick is the
            tick, bit for bit; elsewhere the HIP is interpolated linearly between two rows. Invalid
            times are a ValueError, odd ones a warning.

        Returns
        -------
        array of ``STEP``
            A row for each tick: ``t_s``, ``hip_mm``, ``proxy_mm``, ``force_n``, ``state``.

        Raises
        ------
        StepError
            At the first step that is not possible, with the steps before it.
        """
        rows, remarks, error = self._native.run(*arguments(path_mm, t))
        for remark in remarks:
            warnings.warn(remark, stacklevel=2)
        steps = np.frombuffer(rows, STEP)
        if error is not None:
            raise StepError(f"step {len(steps)} of the path: {error}", steps)
        return steps

    def set_surface(self, surface: Surface) -> None:
        """Changes the surface between two steps; the proxy stays where it is."""
        self._native.set_surface(surface)

    def __repr__(self) -> str:
        return f"<Contact at {self.rate} steps a second on {self.terrain!r}>"


def to_dataframe(steps: npt.NDArray[np.void]) -> pandas.DataFrame:
    """Returns the steps of ``Contact.run`` as a DataFrame. Columns are named as in
    ``hapterra replay``'s CSV, except ``state``, which has the names of ``State``."""
    pandas = pandas_for("hapterra.to_dataframe")
    columns = {"t_s": steps["t_s"]}
    for field, name in (("hip_mm", "{}_mm"), ("proxy_mm", "proxy_{}_mm"), ("force_n", "force_{}_n")):
        for axis, letter in enumerate("xyz"):
            columns[name.format(letter)] = steps[field][:, axis]
    names = [state.name.lower() for state in State]
    columns["state"] = pandas.Categorical.from_codes(steps["state"].astype("i1"), names)
    return pandas.DataFrame(columns)
