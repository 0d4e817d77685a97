"""Terrains of arrays and of georeferenced data."""

from __future__ import annotations

import copy
import os
import pathlib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._command import options, reading_options
from ._grid import Grid, of_rasterio, of_xarray
from ._place import GridScale, Ground, Pair, Path, files, ground_m_per_mm, is_lonlat, pair, resized

if TYPE_CHECKING:
    import rasterio.io
    import xarray

#: Types of samples that are kept as they are; all others become f8.
_NATIVE_TYPES = {"f8", "f4", "i4", "u4", "i2", "u2", "i1", "u1"}
#: Samples that are written at a time.
_BLOCK_SAMPLES = 1 << 20
#: More are left in their file: 1 GiB.
_MAX_WRITTEN = 1 << 27
_SOUTH_FIRST = {"upper": False, "lower": True}


class Terrain:
    """A height field: samples on a square grid, bilinear between them.

    Parameters
    ----------
    heights : array of shape (rows, columns)
        Any real type and memory order. Rows are from west to east. NaN, or a masked sample, is
        no-data: there is no surface and no force. The samples are copied.
    cell_mm : float
        Device millimetres from a sample to the next.
    height_mm_per_unit : float
        Device millimetres for one unit of the heights.
    origin : "upper" or "lower"
        The side of the first row, as in matplotlib's imshow: "upper" is north, as in images
        and GeoTIFF, "lower" is south.
    materials : array of integers of the same shape, optional
        A material for each sample: 0 is the surface itself, 1 the first of
        ``Surface(materials=)``.

    Raises
    ------
    ValueError, TypeError
        For an invalid array. Heights too tall or too steep at this scale are refused
        by ``Contact``.
    """

    #: True if samples have numbers of materials.
    _has_materials = False

    def __init__(
        self,
        heights: npt.ArrayLike,
        *,
        cell_mm: float,
        height_mm_per_unit: float = 1.0,
        origin: str = "upper",
        materials: npt.ArrayLike | None = None,
    ) -> None:
        if origin not in _SOUTH_FIRST:
            raise ValueError(f'origin is {origin!r}: use "upper" (north first) or "lower"')
        samples = _samples(heights)
        if materials is not None:
            materials = _materials(materials, samples.shape)
        self._native = _native.Terrain(
            samples.tobytes(),
            samples.dtype.str[1:],
            samples.shape,
            cell_mm=cell_mm,
            height_mm_per_unit=height_mm_per_unit,
            south_first=_SOUTH_FIRST[origin],
            materials=None if materials is None else materials.tobytes(),
        )
        #: Rows and columns.
        self.shape: tuple[int, int] = samples.shape
        #: Device millimetres from a sample to the next.
        self.cell_mm = float(cell_mm)
        #: Device millimetres for one unit of the heights.
        self.height_mm_per_unit = float(height_mm_per_unit)
        self._has_materials = materials is not None
        #: The data's statements about itself; none for a plain array.
        self.source: dict[str, Any] | None = None
        #: Radius of the ball that touches it, mm; 0 for a point.
        self.tip_mm = 0.0
        self._ground: Ground | None = None
        self._opened: dict[str, Any] | None = None

    @classmethod
    def open(
        cls,
        source: Path | Iterable[Path],
        *,
        cell_mm: float | None = None,
        scale: str | float | None = None,
        exaggeration: float | str | None = None,
        **reading: Any,
    ) -> Terrain:
        """Opens a terrain of any size and of any format that the command ``hapterra`` opens. Only
        the touched part is read, and nothing is copied.

        Parameters
        ----------
        source : path, or paths of several files that are one terrain
            A file, a folder, a pattern as "tiles/*.tif", a GDAL .vrt, a STAC's .json; a URL where
            the package is built with ``remote``.
        cell_mm : float
            Device millimetres from a sample to the next; by default 1, as in ``hapterra replay``. Cells that
            are no squares on the ground are resampled to squares of their shorter side.
        scale : "100 m/mm", or metres as a number
            Ground for a device millimetre, in place of ``cell_mm``.
        exaggeration : float or "auto"
            Factor on true to scale. If the file does not state the size of its cells, a unit of
            heights is a millimetre times this factor.
        **reading
            Properties that the file does not state, by the keys of the command's ``--input``:
            ``band=2``, ``no_data=-9999``, ``height_unit="ft"``, ``gdal={"NAME": "VALUE"}``, ...
            (``hapterra info --help``); and ``cache=``, a folder or "off".

        Raises
        ------
        ValueError, OSError
            With the command's text and hint.

        A step waits for data that has to be fetched. If that fails, the step raises an OSError and
        may be repeated. Damaged parts of a file are no-data, with a warning.
        """
        sizing = {"cell_mm": cell_mm, "scale": scale, "exaggeration": exaggeration}
        paths = files(source)
        native = _native.Terrain.open(paths, [*reading_options(**reading), *options(**_size(sizing))])
        return cls._from_native(native, {"file": paths[0] if len(paths) == 1 else paths}, sizing)

    @classmethod
    def _from_native(cls, native: _native.Terrain, source: dict[str, Any], sizing: dict[str, Any]) -> Terrain:
        terrain = cls.__new__(cls)
        terrain._native, terrain.shape = native, native.shape
        terrain.cell_mm, terrain.height_mm_per_unit = native.scale
        terrain.source = {**source, **dict(native.stated())}
        terrain._ground, terrain._opened, terrain.tip_mm = None, sizing, 0.0
        return terrain

    def place(
        self,
        at: Pair,
        crs: str | None = None,
        *,
        size_mm: Pair,
        cell_mm: float | None = None,
        scale: str | float | None = None,
        exaggeration: float | str | None = None,
    ) -> Terrain:
        """Returns the terrain of a window around a position, with its origin at the window's
        south-west sample.

        ``at`` is (x, y) in the terrain's own coordinates, or with ``crs="lonlat"`` in degrees.
        ``size_mm`` is the extent east and north in the hand, mm, to the nearest cell, within the
        terrain. ``cell_mm``, ``scale`` and ``exaggeration`` are as in ``open``; by default they are
        this terrain's own. Cells are true to scale at the position.

        Raises ValueError for a position outside or without data, and for a terrain without
        coordinates.
        """
        place, lonlat, size = pair("at", at), is_lonlat(crs), pair("size_mm", size_mm)
        georeference = self._georeference()
        if isinstance(georeference, Ground):
            window = self._from_grid(*georeference.window(place, lonlat, size, cell_mm, scale, exaggeration))
        else:
            sizing = resized(self._opened or {}, cell_mm, scale, exaggeration)
            native = georeference.window(place, lonlat, size, options(**_size(sizing)))
            window = self._from_native(native, self.source or {}, sizing)
        return window.with_tip(self.tip_mm) if self.tip_mm else window

    def mm_at(self, x: float, y: float, crs: str | None = None) -> tuple[float, float]:
        """Returns the millimetres east and north from the south-west sample to a position in the
        terrain's own coordinates, or with ``crs="lonlat"`` in degrees. It may be outside the
        terrain."""
        return self._georeference().mm_at((x, y), is_lonlat(crs))

    def ground_at(
        self, east_mm: float, north_mm: float, crs: str | None = None
    ) -> tuple[float, float]:
        """Returns the position in the terrain's own coordinates, or with ``crs="lonlat"`` in
        degrees, at millimetres east and north of the south-west sample."""
        return self._georeference().ground_at((east_mm, north_mm), is_lonlat(crs))

    def _georeference(self) -> Ground | _native.Terrain:
        """Returns the georeference of the terrain."""
        if self._opened is not None:
            return self._native
        if self._ground is None:
            raise ValueError(
                "the terrain is of an array without coordinates: use Terrain.open, from_xarray or"
                " from_rasterio"
            )
        return self._ground

    @classmethod
    def from_xarray(
        cls,
        da: xarray.DataArray,
        *,
        cell_mm: float,
        exaggeration: float = 1.0,
        height_mm_per_unit: float | None = None,
        ground_unit: str | None = None,
        height_unit: str | None = None,
        x: str | None = None,
        y: str | None = None,
    ) -> Terrain:
        """Creates a terrain from a DataArray of two dimensions, true to scale times
        ``exaggeration``.

        Row order and cell size are those of its coordinates, units those of ``attrs["units"]``,
        and ``attrs["_FillValue"]`` marks no-data. ``source`` of the result reports them. Properties
        that are not stated must be passed: ``x`` and ``y`` name the dimensions, ``ground_unit`` and
        ``height_unit`` are "m", "km", "ft" and the like, and ``height_mm_per_unit`` replaces both
        units and the exaggeration.
        """
        sizing = GridScale(cell_mm, exaggeration, height_mm_per_unit, ground_unit, height_unit)
        return cls._from_grid(of_xarray(da, x, y), sizing)

    @classmethod
    def from_rasterio(
        cls,
        ds: rasterio.io.DatasetReader,
        band: int = 1,
        *,
        cell_mm: float,
        exaggeration: float = 1.0,
        height_mm_per_unit: float | None = None,
        ground_unit: str | None = None,
        height_unit: str | None = None,
    ) -> Terrain:
        """Creates a terrain from a band of an open rasterio dataset, true to scale times
        ``exaggeration``.

        Row order and cell size are those of its transform, the units those of its reference system
        and of the band; its no-data value or mask marks no-data, and its scale and offset are
        applied. ``source`` of the result reports them. The rest is as in ``from_xarray``.
        """
        sizing = GridScale(cell_mm, exaggeration, height_mm_per_unit, ground_unit, height_unit)
        return cls._from_grid(of_rasterio(ds, band), sizing)

    @classmethod
    def _from_grid(cls, grid: Grid, grid_scale: GridScale) -> Terrain:
        height_mm_per_unit = grid_scale.height_mm_per_unit
        if height_mm_per_unit is None:
            metres = grid.metres(grid_scale.ground_unit, grid_scale.height_unit)
            height_mm_per_unit = grid_scale.cell_mm * metres.height / metres.cell * grid_scale.exaggeration
        terrain = cls(
            grid.heights,
            cell_mm=grid_scale.cell_mm,
            height_mm_per_unit=height_mm_per_unit,
            origin=grid.origin,
        )
        terrain.source = grid.source()
        terrain._ground = Ground(grid, grid_scale)
        return terrain

    def with_tip(self, mm: float) -> Terrain:
        """Returns the same ground, touched by a ball of this radius; 0 for a point.

        The HIP and the proxy are then the ball's centre, one radius above flat ground, and so is
        ``height_mm``. Forces are those of ``hapterra replay --tip``, bit for bit. The radius is at
        most 8 cells; for larger balls, use every second sample.
        """
        terrain = copy.copy(self)
        terrain._native = self._native.with_tip(mm)
        terrain.tip_mm = float(mm)
        return terrain

    @property
    def size_mm(self) -> tuple[float, float]:
        """Extent east and north from the south-west sample, mm."""
        return self._native.size_mm

    def height_mm(self, east_mm: float, north_mm: float) -> float | None:
        """Returns the height of the surface at a position, mm, or of the ball's centre; None for
        no-data and outside the terrain."""
        return self._native.height_mm(east_mm, north_mm)

    def _write(self, path: pathlib.Path) -> tuple[str, dict[str, Any]]:
        """Writes the heights to a file for the command. Returns the file and the options of its
        scale."""
        if self._has_materials:
            raise ValueError(
                "materials of a Terrain cannot be loaded: pass materials=, a file, and surface=, a file of its classes"
            )
        rows, columns = self.shape
        if rows * columns > _MAX_WRITTEN:
            raise ValueError(
                f"{rows} rows of {columns} samples are too many to be written for a device:"
                ' load the file itself, as device.load("dem.tif", ...), or a window by place()'
            )
        heights = np.lib.format.open_memmap(path, "w+", "=f8", self.shape)
        step = max(1, _BLOCK_SAMPLES // columns)
        for south in range(0, rows, step):
            block = np.frombuffer(self._native.rows(south, step), "=f8").reshape(-1, columns)
            heights[rows - south - len(block) : rows - south] = block[::-1]
        heights.flush()
        scale = {
            "scale": f"{self.cell_mm!r}mm/cell",
            "exaggeration": f"{self.height_mm_per_unit!r}mm/unit",
        }
        tip = {"tip": f"{self.tip_mm}mm"} if self.tip_mm else {}
        return os.fspath(path), {**scale, **tip}

    def __repr__(self) -> str:
        rows, columns = self.shape
        scale = f"cell_mm={self.cell_mm:g}, height_mm_per_unit={self.height_mm_per_unit:g}"
        tip = f", tip_mm={self.tip_mm:g}" if self.tip_mm else ""
        source = f", source={self.source}" if self.source else ""
        return f"<Terrain of {rows} rows and {columns} columns, {scale}{tip}{source}>"


def _samples(heights: npt.ArrayLike) -> npt.NDArray[Any]:
    samples: Any = heights if isinstance(heights, np.ndarray) else np.asarray(heights)
    if samples.dtype.kind not in "fiub":
        raise TypeError(f"heights are of {samples.dtype}: use real numbers")
    if samples.ndim != 2:
        raise ValueError(f"heights have the shape {samples.shape}: use (rows, columns)")
    if isinstance(samples, np.ma.MaskedArray):
        is_whole = not np.ma.getmaskarray(samples).any()
        samples = samples.data if is_whole else np.ma.filled(samples.astype("f8"), np.nan)
    native = samples.dtype.newbyteorder("=")
    kind = native if native.str[1:] in _NATIVE_TYPES else np.dtype("f8")
    return np.asarray(samples, kind)


def _materials(materials: npt.ArrayLike, shape: tuple[int, ...]) -> npt.NDArray[np.uint8]:
    of = np.asarray(materials)
    if of.shape != shape:
        raise ValueError(f"materials have the shape {of.shape}, and the heights {shape}")
    if of.dtype.kind not in "iub" or (of.size and not 0 <= of.min() <= of.max() <= 15):
        raise ValueError("materials are integers from 0 to 15")
    return of.astype(np.uint8)


def _size(sizing: dict[str, Any]) -> dict[str, Any]:
    """Returns the size in the hand, by the command's names."""
    scale = ground_m_per_mm(sizing["scale"])
    return {"cell_mm": sizing["cell_mm"], "ground_m_per_mm": scale, "exaggeration": sizing["exaggeration"]}
