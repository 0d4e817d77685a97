"""Recordings, and their replay."""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._command import Word, options, run
from ._dataframe import pandas_for

if TYPE_CHECKING:
    import pandas


class Recording:
    """A recording of ``hapterra run``, ``demo`` or ``replay``, in memory."""

    #: The file.
    path: str
    #: Recorded settings of terrain, placement, scale, surface and device; empty if there are none.
    #: Names are those of docs/reference/recordings.md, with the unit at their end.
    settings: dict[str, Any]
    #: A row a tick, with all columns: ``t_s`` (s), ``x_mm``, ``y_mm``, ``z_mm`` (the HIP, mm: east,
    #: north, up), ``contact`` (0 or 1), ``proxy_x_mm``, ... (mm), ``force_x_n``, ... (N), and more.
    steps: npt.NDArray[np.void]

    def __init__(self, path: str, settings: dict[str, Any], steps: npt.NDArray[np.void]) -> None:
        self.path, self.settings, self.steps = path, settings, steps
        #: Keeps the file of a replay without ``output``.
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    @property
    def marks(self) -> list[dict[str, Any]]:
        """The marked moments: ``tick``, ``t_s``, ``host_unix_s``, ``text``."""
        return list(self.settings.get("mark", []))

    @property
    def views(self) -> list[dict[str, Any]]:
        """The placements after the first one, by the ``number`` in the column ``view``."""
        return list(self.settings.get("view", []))

    def to_dataframe(self) -> pandas.DataFrame:
        """Returns the steps as a DataFrame, whose ``attrs`` are the settings."""
        pandas = pandas_for("to_dataframe")
        frame = pandas.DataFrame(self.steps)
        frame.attrs.update(self.settings)
        return frame

    def replay(
        self, terrain: Word | None = None, *, output: Word | None = None, **changes: Any
    ) -> Recording:
        """Renders the recorded path again, by ``hapterra replay``, with the recorded settings.

        Parameters
        ----------
        terrain : path, optional
            The terrain file, if it is not at the recorded place.
        output : path, optional
            A file for the new recording, .csv or .parquet; by default a temporary one.
        **changes
            Options of the command by their names: ``friction=0.1``, ``surface="sand"``,
            ``ignore_settings=True``, ... (``hapterra replay --help``). Without any, the forces are
            the recorded ones, bit for bit.

        Raises
        ------
        CommandError
            With the command's text and hint; as for another terrain.
        """
        if terrain is None:
            terrain = self.settings.get("terrain", {}).get("file")
        if terrain is None:
            raise ValueError("the recording does not name its terrain: pass terrain=")
        folder = None
        if output is None:
            folder = tempfile.TemporaryDirectory(prefix="hapterra-")
            output = os.path.join(folder.name, "felt.parquet")
        run("replay", *options(**changes, out=output), "--", terrain, self.path)
        recording = read_recording(output)
        recording._folder = folder
        return recording

    def __repr__(self) -> str:
        file = self.settings.get("terrain", {}).get("file", "an unknown terrain")
        return f"<Recording {self.path}: {len(self.steps)} steps on {file}>"


def read_recording(path: Word) -> Recording:
    """Reads a recording, CSV or Parquet, with its settings.

    Raises
    ------
    OSError
        Where the file cannot be read.
    ValueError
        Where it is no recording or trajectory, with the command's text and hint.
    """
    name = os.fspath(path)
    with open(name, "rb"):
        pass
    settings, columns, was_cut = _native.recording(name)
    if was_cut:
        warnings.warn("its last row is cut in the middle, and left out", stacklevel=2)
    arrays = {
        column: np.array(texts, "U") if kind == "U" else np.frombuffer(values, f"={kind}")
        for column, kind, values, texts in columns
    }
    rows = len(next(iter(arrays.values())))
    steps = np.empty(rows, [(column, array.dtype) for column, array in arrays.items()])
    for column, array in arrays.items():
        steps[column] = array
    return Recording(name, json.loads(settings or "{}"), steps)
