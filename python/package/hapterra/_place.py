"""Positions in georeferenced terrains: windows around a position, and coordinates."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Union

from ._grid import Grid

Path = Union[str, "os.PathLike[str]"]
Pair = Sequence[float]

_SCALE = re.compile(r"\s*([0-9.eE+-]+)\s*(m|km)\s*/\s*mm\s*")


def ground_m_per_mm(scale: str | float | None) -> float | None:
    """Returns the ground metres in a device millimetre, from "100 m/mm" or the number itself."""
    if scale is None or isinstance(scale, (int, float)):
        return scale
    found = _SCALE.fullmatch(scale)
    try:
        metres = float(found[1]) if found else None
    except ValueError:
        metres = None
    if not found or metres is None:
        raise ValueError(f'scale is {scale!r}: use ground per millimetre, as "100 m/mm" or "1 km/mm"')
    return metres * (1000 if found[2] == "km" else 1)


def files(source: Path | Iterable[Path]) -> list[str]:
    """Returns the files of one source or of several."""
    if isinstance(source, (str, os.PathLike)):
        return [os.fspath(source)]
    return [os.fspath(path) for path in source]


def pair(name: str, values: Pair) -> tuple[float, float]:
    """Returns two numbers."""
    numbers = tuple(map(float, values))
    if len(numbers) != 2:
        raise ValueError(f"{name} has {len(numbers)} numbers: pass 2")
    return numbers[0], numbers[1]


def is_lonlat(crs: str | None) -> bool:
    """Returns True if coordinates are longitude and latitude, and not the terrain's own."""
    if crs not in (None, "lonlat"):
        raise ValueError(f'crs is {crs!r}: use "lonlat", or leave it out for the terrain\'s own')
    return crs == "lonlat"


def resized(
    sizing: dict[str, Any],
    cell_mm: float | None,
    scale: str | float | None,
    exaggeration: float | str | None,
) -> dict[str, Any]:
    """Returns the size of an opened terrain, with the given values instead of its own."""
    if not (cell_mm is None and scale is None):
        sizing = {**sizing, "cell_mm": cell_mm, "scale": scale}
    return sizing if exaggeration is None else {**sizing, "exaggeration": exaggeration}


class GridScale(NamedTuple):
    """The scale of a grid's terrain."""

    cell_mm: float
    exaggeration: float
    height_mm_per_unit: float | None
    ground_unit: str | None
    height_unit: str | None


class Ground:
    """The position of an array's terrain, in the coordinates of its data."""

    def __init__(self, grid: Grid, grid_scale: GridScale) -> None:
        self._grid, self._scale = grid, grid_scale

    def mm_at(self, at: tuple[float, float], lonlat: bool) -> tuple[float, float]:
        """Returns the millimetres east and north to a position."""
        _refuse_lonlat(lonlat)
        (west, south), (east, north) = self._grid.corner, self._grid.cell
        cell_mm = self._scale.cell_mm
        return (at[0] - west) / east * cell_mm, (at[1] - south) / north * cell_mm

    def ground_at(self, mm: tuple[float, float], lonlat: bool) -> tuple[float, float]:
        """Returns the position at millimetres east and north."""
        _refuse_lonlat(lonlat)
        (west, south), (east, north) = self._grid.corner, self._grid.cell
        cell_mm = self._scale.cell_mm
        return west + mm[0] / cell_mm * east, south + mm[1] / cell_mm * north

    def window(
        self,
        at: tuple[float, float],
        lonlat: bool,
        size_mm: tuple[float, float],
        cell_mm: float | None,
        scale: str | float | None,
        exaggeration: float | str | None,
    ) -> tuple[Grid, GridScale]:
        """Returns the samples around a position, and the scale of their terrain."""
        grid, grid_scale = self._grid, self._scale
        metres = ground_m_per_mm(scale)
        if metres is not None:
            cell_mm = grid.metres(grid_scale.ground_unit, grid_scale.height_unit).cell / metres
        middle = [mm / grid_scale.cell_mm for mm in self.mm_at(at, lonlat)]
        if cell_mm is not None:
            height = grid_scale.height_mm_per_unit
            height = None if height is None else height * cell_mm / grid_scale.cell_mm
            grid_scale = grid_scale._replace(cell_mm=cell_mm, height_mm_per_unit=height)
        if exaggeration is not None:
            grid_scale = grid_scale._replace(exaggeration=float(exaggeration))
        rows, columns = grid.heights.shape
        west, east = _span(at, middle[0], size_mm[0] / grid_scale.cell_mm, columns - 1)
        south, north = _span(at, middle[1], size_mm[1] / grid_scale.cell_mm, rows - 1)
        first, end = south, north + 1
        if grid.origin == "upper":
            first, end = rows - 1 - north, rows - south
        (x, y), (wide, high) = grid.corner, grid.cell
        corner = (x + west * wide, y + south * high)
        heights = grid.heights[first:end, west : east + 1]
        return replace(grid, heights=heights, corner=corner), grid_scale


def _span(
    at: tuple[float, float], middle: float, cells: float, last: int
) -> tuple[int, int]:
    """Returns the first and the last sample of a window."""
    if not 0 <= middle <= last:
        raise ValueError(f"{at} is outside of the terrain")
    if not 1 <= cells < 2**31:
        raise ValueError(f"size_mm is {cells:g} cells: use at least one, in device millimetres")
    begin = math.floor(middle - cells / 2 + 0.5)
    end = min(max(begin + math.floor(cells + 0.5), 1), last)
    return min(max(begin, 0), end - 1), end


def _refuse_lonlat(lonlat: bool) -> None:
    if lonlat:
        raise ValueError(
            'the coordinates of an array are its own: leave crs="lonlat" out, or use Terrain.open,'
            " which supports projections"
        )
