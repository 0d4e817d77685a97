"""Terrains of arrays and of georeferenced data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._grid import Grid, of_rasterio, of_xarray

if TYPE_CHECKING:
    import rasterio.io
    import xarray

#: Types of samples that are kept as they are; all others become f8.
_KEPT = {"f8", "f4", "i4", "u4", "i2", "u2", "i1", "u1"}
#: Samples that are written at a time.
_WRITTEN = 1 << 20
_SOUTH_FIRST = {"upper": False, "lower": True}


class Terrain:
    """A height field: samples on a square grid, bilinear between them.

    Parameters
    ----------
    heights : array of shape (rows, columns)
        Any real type and memory order. Rows lie from west to east. NaN, or a masked sample, is a
        hole: there is no surface and no force. The samples are copied.
    cell_mm : float
        Millimetres of the hand from a sample to the next.
    height_mm_per_unit : float
        Millimetres of the hand for one unit of the heights.
    origin : "upper" or "lower"
        Which end the first row lies at, as in matplotlib's imshow: "upper" is north, as in images
        and GeoTIFF, "lower" is south.
    materials : array of integers of the same shape, optional
        A material for each sample: 0 is the surface itself, 1 the first of
        ``Surface(materials=)``.

    Raises
    ------
    ValueError, TypeError
        For an array that is no terrain. Heights too tall or too steep at this scale are refused
        by ``Contact``.
    """

    #: Whether samples have numbers of materials.
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
            raise ValueError(f'origin is {origin!r}: give "upper" (north first) or "lower"')
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
        #: Millimetres of the hand from a sample to the next.
        self.cell_mm = float(cell_mm)
        #: Millimetres of the hand for one unit of the heights.
        self.height_mm_per_unit = float(height_mm_per_unit)
        self._has_materials = materials is not None
        #: What the data stated about itself; none of a plain array.
        self.source: dict[str, Any] | None = None

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
        """A terrain of a DataArray of two dimensions, true to scale times ``exaggeration``.

        Row order and cell size are those of its coordinates, units those of ``attrs["units"]``,
        and ``attrs["_FillValue"]`` makes holes. ``source`` of the result reports them. What is not
        stated has to be given: ``x`` and ``y`` name the dimensions, ``ground_unit`` and
        ``height_unit`` are "m", "km", "ft" and the like, and ``height_mm_per_unit`` takes the place
        of both units and of the exaggeration.
        """
        grid = of_xarray(da, x, y)
        return cls._of(grid, cell_mm, exaggeration, height_mm_per_unit, ground_unit, height_unit)

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
        """A terrain of a band of an open rasterio dataset, true to scale times ``exaggeration``.

        Row order and cell size are those of its transform, the units those of its reference system
        and of the band; its no-data value or mask makes holes, and its scale and offset are
        applied. ``source`` of the result reports them. The rest is as in ``from_xarray``.
        """
        grid = of_rasterio(ds, band)
        return cls._of(grid, cell_mm, exaggeration, height_mm_per_unit, ground_unit, height_unit)

    @classmethod
    def _of(
        cls,
        grid: Grid,
        cell_mm: float,
        exaggeration: float,
        height_mm_per_unit: float | None,
        ground_unit: str | None,
        height_unit: str | None,
    ) -> Terrain:
        if height_mm_per_unit is None:
            metres = grid.metres(ground_unit, height_unit)
            height_mm_per_unit = cell_mm * metres.height / metres.cell * exaggeration
        terrain = cls(
            grid.heights,
            cell_mm=cell_mm,
            height_mm_per_unit=height_mm_per_unit,
            origin=grid.origin,
        )
        terrain.source = grid.source()
        return terrain

    @property
    def size_mm(self) -> tuple[float, float]:
        """Extent east and north from the south-west sample, mm."""
        return self._native.size_mm

    def height_mm(self, east_mm: float, north_mm: float) -> float | None:
        """The height of the surface at a place, mm; None in a hole and off the terrain."""
        return self._native.height_mm(east_mm, north_mm)

    def _write(self, path: Path) -> tuple[str, dict[str, Any]]:
        """Writes the heights as a file of the command. Returns it, and the options of its scale."""
        if self._has_materials:
            raise ValueError(
                "materials of a Terrain cannot be loaded: give materials= and material_table=, files"
            )
        rows, columns = self.shape
        heights = np.lib.format.open_memmap(path, "w+", "=f8", self.shape)
        step = max(1, _WRITTEN // columns)
        for south in range(0, rows, step):
            block = np.frombuffer(self._native.rows(south, step), "=f8").reshape(-1, columns)
            heights[rows - south - len(block) : rows - south] = block[::-1]
        heights.flush()
        scale = {"cell_mm": self.cell_mm, "height_mm_per_unit": self.height_mm_per_unit}
        return str(path), scale

    def __repr__(self) -> str:
        rows, columns = self.shape
        scale = f"cell_mm={self.cell_mm:g}, height_mm_per_unit={self.height_mm_per_unit:g}"
        source = f", source={self.source}" if self.source else ""
        return f"<Terrain of {rows} rows and {columns} columns, {scale}{source}>"


def _samples(heights: npt.ArrayLike) -> npt.NDArray[Any]:
    samples: Any = heights if isinstance(heights, np.ndarray) else np.asarray(heights)
    if samples.dtype.kind not in "fiub":
        raise TypeError(f"heights are of {samples.dtype}: give real numbers")
    if samples.ndim != 2:
        raise ValueError(f"heights have the shape {samples.shape}: give (rows, columns)")
    if isinstance(samples, np.ma.MaskedArray):
        is_whole = not np.ma.getmaskarray(samples).any()
        samples = samples.data if is_whole else np.ma.filled(samples.astype("f8"), np.nan)
    native = samples.dtype.newbyteorder("=")
    kind = native if native.str[1:] in _KEPT else np.dtype("f8")
    return np.asarray(samples, kind)


def _materials(materials: npt.ArrayLike, shape: tuple[int, ...]) -> npt.NDArray[np.uint8]:
    of = np.asarray(materials)
    if of.shape != shape:
        raise ValueError(f"materials have the shape {of.shape}, and the heights {shape}")
    if of.dtype.kind not in "iub" or (of.size and not 0 <= of.min() <= of.max() <= 15):
        raise ValueError("materials are integers from 0 to 15")
    return of.astype(np.uint8)
