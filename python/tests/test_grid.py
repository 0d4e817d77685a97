"""Terrains from xarray and rasterio, by their own metadata."""

import numpy as np
import pytest
import rasterio
import xarray

from hapterra import Terrain

# The first row is the northern one; heights in metres, 30 m a cell.
HEIGHTS = np.arange(20.0).reshape(4, 5) * 10
X, Y = 500_000 + 30.0 * np.arange(5), 4_000_000 - 30.0 * np.arange(4)
METRES = {"units": "m"}


def array(heights=HEIGHTS, x=X, y=Y, dims=("y", "x"), units=METRES, **attrs):
    coords = {"x": ("x", x, units), "y": ("y", y, units)}
    attrs = {"units": "m", **attrs}
    return xarray.DataArray(heights, coords, dims, attrs=attrs)


def same(terrain, heights=HEIGHTS, mm_per_unit=0.5 / 30):
    """Fails unless the first row of heights is in the north."""
    assert terrain.height_mm_per_unit == pytest.approx(mm_per_unit)
    found = [[terrain.height_mm(0.5 * c, 0.5 * r) for c in range(5)] for r in (3, 2, 1, 0)]
    assert np.array(found) == pytest.approx(heights * terrain.height_mm_per_unit)


def test_xarray_is_placed_by_its_coordinates():
    for da in [
        array(),
        array(HEIGHTS[::-1], y=Y[::-1]),
        array(HEIGHTS[:, ::-1], x=X[::-1]),
        array(HEIGHTS.T, dims=("x", "y")),
        array(HEIGHTS.astype("i2")),
        array().rename(x="easting", y="northing"),
    ]:
        same(Terrain.from_xarray(da, cell_mm=0.5))
    assert Terrain.from_xarray(array(), cell_mm=0.5).source == {
        "origin": "upper",
        "cell": (30, 30),
        "ground_unit": "m",
        "height_unit": "m",
        "nodata": None,
        "holes": 0,
    }
    assert Terrain.from_xarray(array(y=Y[::-1]), cell_mm=1).source["origin"] == "lower"


def test_units_and_exaggeration_scale_the_heights():
    feet = array(HEIGHTS / 0.3048)
    feet.attrs["units"] = "feet"
    same(Terrain.from_xarray(feet, cell_mm=0.5), HEIGHTS / 0.3048, 0.5 / 30 * 0.3048)
    km = array(x=X / 1000, y=Y / 1000, units={"units": "km"})
    same(Terrain.from_xarray(km, cell_mm=0.5, exaggeration=3), mm_per_unit=0.05)
    bare = array(units={})
    del bare.attrs["units"]
    with pytest.raises(ValueError, match='unit of its coordinates: pass ground_unit="m"'):
        Terrain.from_xarray(bare, cell_mm=0.5)
    with pytest.raises(ValueError, match='unit of its heights: pass height_unit="m"'):
        Terrain.from_xarray(bare, cell_mm=0.5, ground_unit="m")
    with pytest.raises(ValueError, match="height_unit is 'furlong': use one of m, km"):
        Terrain.from_xarray(bare, cell_mm=0.5, ground_unit="m", height_unit="furlong")
    same(Terrain.from_xarray(bare, cell_mm=0.5, ground_unit="metre", height_unit="m"))
    same(Terrain.from_xarray(bare, cell_mm=0.5, height_mm_per_unit=0.1), mm_per_unit=0.1)


@pytest.mark.parametrize("dtype", ["i2", "f4"])
def test_no_data_of_xarray_makes_holes(dtype):
    heights = HEIGHTS.astype(dtype)
    heights[0, 0] = -999
    terrain = Terrain.from_xarray(array(heights, _FillValue=-999), cell_mm=0.5)
    assert (terrain.source["nodata"], terrain.source["holes"]) == (-999, 1)
    assert terrain.height_mm(0.25, 1.25) is None and terrain.height_mm(1.25, 1.25) is not None
    scaled = array(heights, _FillValue=-999, scale_factor=0.5, add_offset=7)
    terrain = Terrain.from_xarray(scaled, cell_mm=0.5, height_mm_per_unit=1)
    assert (terrain.source["holes"], terrain.height_mm(2, 0)) == (1, 102)


def test_grids_that_are_no_squares_are_errors():
    degrees = array(x=np.arange(5.0), y=np.arange(4.0), units={"units": "degrees_north"})
    for da, text in [
        (degrees, "cells are degrees"),
        (array(y=Y * 2), "cells are 30 by 60"),
        (array(x=[0, 30, 61, 90, 120]), "coordinates x are not even"),
        (array().expand_dims("time"), "dimensions .*'time'.*: choose two"),
        (array().rename(x="a"), "which of the dimensions .* is x"),
        (array().drop_vars("x"), "x has no coordinates"),
    ]:
        with pytest.raises(ValueError, match=text):
            Terrain.from_xarray(da, cell_mm=0.5)
    same(Terrain.from_xarray(array().rename(x="a"), cell_mm=0.5, x="a"))
    touched = Terrain.from_xarray(degrees, cell_mm=0.5, height_mm_per_unit=1)
    assert touched.source["ground_unit"] == "degree"


def test_xarray_has_the_places_of_its_coordinates():
    for da in [array(), array(HEIGHTS[::-1], y=Y[::-1]), array(HEIGHTS[:, ::-1], x=X[::-1])]:
        terrain = Terrain.from_xarray(da, cell_mm=0.5)
        assert terrain.mm_at(500_030, 3_999_970) == (0.5, 1)
        assert terrain.ground_at(0.5, 1) == (500_030, 3_999_970)
        window = terrain.place((500_060, 3_999_970), size_mm=(1, 1), cell_mm=0.25)
        assert window.shape == (4, 5) and window.mm_at(500_000, 3_999_910) == (0, 0)
        window = terrain.place((500_060, 3_999_970), size_mm=(1, 1))
        assert window.shape == (3, 3) and window.mm_at(500_030, 3_999_940) == (0, 0)
        assert window.height_mm(0.5, 0.5) == terrain.height_mm(1, 1)
    fixed = Terrain.from_xarray(array(), cell_mm=0.5, height_mm_per_unit=0.1)
    finer = fixed.place((500_060, 3_999_970), size_mm=(9, 9), cell_mm=1)
    assert finer.height_mm_per_unit == 0.2


def dataset(heights=HEIGHTS, transform=None, crs="EPSG:32633", nodata=None, unit="m", scale=1.0):
    transform = transform or rasterio.Affine(30, 0, 500_000, 0, -30, 4_000_000)
    memory = rasterio.MemoryFile()
    kind = dict(driver="GTiff", count=2, dtype=heights.dtype, crs=crs, transform=transform)
    with memory.open(height=4, width=5, nodata=nodata, **kind) as ds:
        ds.write(heights, 2)
        ds.scales, ds.offsets = (1, scale), (0, 0)
        if unit:
            ds.set_band_unit(2, unit)
    return memory.open()


def test_rasterio_is_placed_by_its_transform():
    for heights, transform in [
        (HEIGHTS, None),
        (HEIGHTS[::-1], rasterio.Affine(30, 0, 5e5, 0, 30, 4e6)),
        (HEIGHTS[:, ::-1], rasterio.Affine(-30, 0, 5e5, 0, -30, 4e6)),
    ]:
        with dataset(heights, transform) as ds:
            terrain = Terrain.from_rasterio(ds, 2, cell_mm=0.5)
        same(terrain)
        assert terrain.source["ground_unit"] == terrain.source["height_unit"] == "m"
    with dataset(crs="EPSG:2263", unit=None) as ds:
        terrain = Terrain.from_rasterio(ds, 2, cell_mm=0.5, height_unit="m")
        same(terrain, mm_per_unit=0.5 / 30 * 3937 / 1200)
        with pytest.raises(ValueError, match="unit of its heights"):
            Terrain.from_rasterio(ds, 2, cell_mm=0.5)


@pytest.mark.parametrize("dtype", ["i2", "f4"])
def test_no_data_of_rasterio_makes_holes(dtype):
    heights = HEIGHTS.astype(dtype)
    heights[0, 0] = -999
    with dataset(heights, nodata=-999, scale=0.5) as ds:
        terrain = Terrain.from_rasterio(ds, 2, cell_mm=0.5, height_mm_per_unit=1)
    assert (terrain.source["nodata"], terrain.source["holes"]) == (-999, 1)
    assert terrain.height_mm(0.25, 1.25) is None and terrain.height_mm(2, 0) == 95


def test_datasets_that_are_no_squares_are_errors():
    turned = rasterio.Affine(28, 10, 5e5, 10, -28, 4e6)
    for options, band, text in [
        ({"transform": turned}, 2, "turned against north"),
        ({"crs": "EPSG:4326"}, 2, "cells are degrees"),
        ({"crs": None}, 2, "unit of its coordinates"),
        ({}, 3, "band is 3, and the dataset has 2"),
    ]:
        with dataset(**options) as ds, pytest.raises(ValueError, match=text):
            Terrain.from_rasterio(ds, band, cell_mm=0.5)
