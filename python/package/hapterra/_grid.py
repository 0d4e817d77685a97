"""Heights with the properties in their metadata: row order, no-data, cell size and units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

_METRES = {"m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "us-ft": 1200 / 3937}
_NAMES = {
    **dict.fromkeys(("metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("kilometre", "kilometres", "kilometer", "kilometers"), "km"),
    **dict.fromkeys(("foot", "feet"), "ft"),
    "us survey foot": "us-ft",
}
_DEGREES = "degree"
#: Names and standard names of coordinates, used if no axis is stated.
_X = {"x", "lon", "longitude", "easting", "projection_x_coordinate"}
_Y = {"y", "lat", "latitude", "northing", "projection_y_coordinate"}


class Metres(NamedTuple):
    """Metres of a cell, and of a unit of the heights."""

    cell: float
    height: float


@dataclass
class Grid:
    """Heights in their original row order: rows from west to east."""

    heights: npt.NDArray[Any]
    origin: str
    #: Distance of neighbouring samples, east and north, in the unit of the ground.
    cell: tuple[float, float]
    ground_unit: str | None
    height_unit: str | None
    nodata: float | None
    #: Position of the south-west sample, in the unit of the ground.
    corner: tuple[float, float]

    def source(self) -> dict[str, Any]:
        """The stated properties, and the number of no-data samples."""
        return {
            "origin": self.origin,
            "cell": self.cell,
            "ground_unit": self.ground_unit,
            "height_unit": self.height_unit,
            "nodata": self.nodata,
            "holes": int(np.isnan(self.heights).sum()),
        }

    def metres(self, ground_unit: str | None, height_unit: str | None) -> Metres:
        """Returns the size of a cell and of a unit of the heights: the given one, else the stated
        one."""
        ground_unit = ground_unit or self.ground_unit
        if ground_unit == _DEGREES:
            raise ValueError(
                "cells are degrees, which are no squares on the ground: reproject to a system in"
                " metres, or pass height_mm_per_unit to touch the samples as squares"
            )
        east, north = self.cell
        if not np.isclose(east, north, rtol=1e-3):
            raise ValueError(
                f"cells are {east:g} by {north:g}: resample to squares, or pass height_mm_per_unit"
                " to touch the samples as squares"
            )
        ground = _metres("ground", "coordinates", ground_unit)
        return Metres(ground * east, _metres("height", "heights", height_unit or self.height_unit))


def _metres(word: str, what: str, unit: str | None) -> float:
    if unit is None:
        raise ValueError(
            f'the data does not state the unit of its {what}: pass {word}_unit="m", or'
            " height_mm_per_unit"
        )
    known = _METRES.get(_unit(unit) or "")
    if known is None:
        units = ", ".join(_METRES)
        raise ValueError(f"{word}_unit is {unit!r}: use one of {units}, or height_mm_per_unit")
    return known


def _unit(name: Any) -> str | None:
    """Returns a unit's canonical spelling."""
    if not name:
        return None
    text = str(name).strip().lower()
    return _DEGREES if text.startswith("degree") else _NAMES.get(text, text)


def of_xarray(da: Any, x: Any, y: Any) -> Grid:
    """Returns the grid of a DataArray."""
    if da.ndim != 2:
        raise ValueError(
            f"the array has the dimensions {da.dims}: choose two, as da.isel(time=0) or da.squeeze()"
        )
    x = x or _dimension(da, "x", "X", _X)
    y = y or _dimension(da, "y", "Y", _Y)
    (east, order_x), (north, order_y) = _spacing(da, x), _spacing(da, y)
    da = da.transpose(y, x)
    stored = np.asarray(da.values)
    heights = _floats(stored)
    # No-data that xarray has decoded is already NaN.
    nodata = da.attrs.get("_FillValue", da.attrs.get("missing_value"))
    if nodata is not None:
        heights = np.where(stored == nodata, np.nan, heights)
    attrs = da.attrs
    heights = _scaled(heights, attrs.get("scale_factor", 1), attrs.get("add_offset", 0))
    return Grid(
        heights[:, ::order_x],
        "lower" if order_y > 0 else "upper",
        (east, north),
        _unit(da[x].attrs.get("units")),
        _unit(attrs.get("units")),
        None if nodata is None else float(nodata),
        (float(np.min(da[x].values)), float(np.min(da[y].values))),
    )


def _floats(stored: Any) -> Any:
    """Returns the samples in a type that has NaN."""
    return stored if stored.dtype.kind == "f" else stored.astype("f8")


def _scaled(heights: Any, scale: float, offset: float) -> Any:
    return heights if (scale, offset) == (1, 0) else heights * scale + offset


def _dimension(da: Any, word: str, axis: str, names: set[str]) -> Any:
    def matches(name: Any) -> bool:
        attrs = da[name].attrs if name in da.coords else {}
        stated = {str(name).lower(), attrs.get("standard_name")}
        return attrs.get("axis") == axis or bool(stated & names)

    found = [name for name in da.dims if matches(name)]
    if len(found) != 1:
        raise ValueError(f"which of the dimensions {da.dims} is {word}? pass {word}=")
    return found[0]


def _spacing(da: Any, name: str) -> tuple[float, int]:
    """Returns the spacing of regular coordinates, and 1 if they rise or -1 if they fall."""
    if name not in da.coords:
        raise ValueError(
            f"the dimension {name} has no coordinates: set them with assign_coords, or use"
            " Terrain(da.values, cell_mm=, origin=)"
        )
    places = np.asarray(da[name].values, dtype="f8")
    if len(places) < 2:
        raise ValueError(f"the dimension {name} has {len(places)} samples: at least 2 are required")
    step = (places[-1] - places[0]) / (len(places) - 1)
    even = places[0] + step * np.arange(len(places))
    if not (step and np.abs(places - even).max() <= 0.01 * abs(step)):
        raise ValueError(f"the coordinates {name} are not even: resample them with da.interp")
    return abs(step), 1 if step > 0 else -1


def of_rasterio(ds: Any, band: int) -> Grid:
    """Returns the grid of a band of a dataset."""
    if not 1 <= band <= ds.count:
        raise ValueError(f"band is {band}, and the dataset has {ds.count}, from 1 on")
    to_ground = ds.transform
    if to_ground.b or to_ground.d:
        raise ValueError("the dataset is turned against north: warp it with rasterio.warp")
    stored = ds.read(band, masked=True)
    heights = _scaled(_floats(stored).filled(np.nan), ds.scales[band - 1], ds.offsets[band - 1])
    unit = None
    if ds.crs is not None and ds.crs.is_geographic:
        unit = _DEGREES
    elif ds.crs is not None and ds.crs.is_projected:
        unit = _unit(ds.crs.linear_units)
    x = [to_ground.c + to_ground.a * column for column in (0.5, ds.width - 0.5)]
    y = [to_ground.f + to_ground.e * row for row in (0.5, ds.height - 0.5)]
    return Grid(
        heights[:, :: 1 if to_ground.a > 0 else -1],
        "lower" if to_ground.e > 0 else "upper",
        (abs(to_ground.a), abs(to_ground.e)),
        unit,
        _unit(ds.units[band - 1]),
        ds.nodatavals[band - 1],
        (min(x), min(y)),
    )
