"""Terrains from files, read where they are touched."""

import os
import subprocess
import sys

import numpy as np
import pytest
import rasterio
from test_replay import CELL_MM, FLAGS, ROUGH, hills, replayed, same, stroke

from hapterra import Contact, State, Surface, Terrain

UTM = rasterio.Affine(30, 0, 500_000, 0, -30, 4_000_000)
#: For a position at 47° north, where a degree of longitude is two thirds of one of latitude.
DEGREES = rasterio.Affine(1 / 3600, 0, 7.6, 0, -1 / 3600, 47.0)


def written(path, heights=None, transform=UTM, crs="EPSG:32633", **how):
    """Writes a GeoTIFF of heights, m; hills of 180 m by default."""
    heights = (30 * hills()).astype("f4") if heights is None else heights
    rows, columns = heights.shape
    kind = dict(driver="GTiff", count=1, dtype=heights.dtype, crs=crs, transform=transform)
    with rasterio.open(path, "w", width=columns, height=rows, **kind, **how) as ds:
        ds.write(heights, 1)
        ds.set_band_unit(1, "m")
    return path


def tiles(folder):
    """Writes the same hills to two adjacent files."""
    heights = (30 * hills()).astype("f4")
    west = written(folder / "a.tif", heights[:, :64])
    east = written(folder / "b.tif", heights[:, 64:], rasterio.Affine(30, 0, 501_920, 0, -30, 4_000_000))
    return [west, east]


def degrees(folder):
    return written(folder / "d.tif", transform=DEGREES, crs="EPSG:4326")


@pytest.mark.parametrize("surface, flags", [({}, []), (ROUGH, FLAGS)], ids=["ice", "rough"])
@pytest.mark.parametrize(
    "make, reading",
    [
        (lambda folder: written(folder / "hills.tif"), {}),
        (lambda folder: written(folder / "hills.tif"), {"in_memory": 0}),
        (degrees, {}),
        (degrees, {"in_memory": 0, "height_unit": "ft"}),
        (lambda folder: tiles(folder) and folder / "*.tif", {}),
    ],
    ids=["memory", "file", "degrees", "feet", "pattern"],
)
def test_opened_terrain_is_a_replay(tmp_path, surface, flags, make, reading):
    file = make(tmp_path)
    path = stroke(20_000)
    words = [f"--input={name.replace('_', '-')}={value}" for name, value in reading.items()]
    columns = replayed(tmp_path, file, path, words=[f"--scale={CELL_MM}mm/cell", *flags, *words])
    terrain = Terrain.open(file, cell_mm=CELL_MM, **reading)
    touching = same(Contact(terrain, Surface(**surface)).run(path), columns)
    assert 2_000 < touching < 18_000, touching


def test_several_files_are_one_terrain(tmp_path):
    whole = Terrain.open(tiles(tmp_path), cell_mm=0.5)
    assert whole.shape == (97, 130)
    other = Terrain.open(str(tmp_path / "*.tif"), cell_mm=0.5)
    for place in [(1, 1), (31.8, 20), (60, 40)]:
        assert whole.height_mm(*place) == other.height_mm(*place) is not None
    with pytest.raises(ValueError, match="no file is named"):
        Terrain.open([])


def test_scale_is_ground_for_a_millimetre(tmp_path):
    file = written(tmp_path / "hills.tif")
    terrain = Terrain.open(file, scale="100 m/mm")
    assert terrain.cell_mm == pytest.approx(0.3, rel=1e-3)
    # The map's scale is 0.9996 in its middle.
    assert terrain.height_mm_per_unit == pytest.approx(0.01, rel=1e-9)
    for same_scale in ("0.1 km/mm", 100):
        assert Terrain.open(file, scale=same_scale).cell_mm == terrain.cell_mm
    twice = Terrain.open(file, scale="100 m/mm", exaggeration=2)
    assert twice.height_mm_per_unit == 2 * terrain.height_mm_per_unit
    assert Terrain.open(file).cell_mm == 1
    relief = Terrain.open(file, cell_mm=0.001, exaggeration="auto").height_mm_per_unit * 380
    assert 14 < relief < 16


def test_metadata_of_the_file_is_reported(tmp_path):
    source = Terrain.open(written(tmp_path / "hills.tif")).source
    assert source["file"] == str(tmp_path / "hills.tif")
    assert source["crs"] == "EPSG:32633" and source["height_unit_m"] == "1"
    assert "TIFF" in source["format"]


def test_bad_words_have_the_text_of_the_command(tmp_path):
    file = written(tmp_path / "hills.tif")
    for error, text, path, words in [
        (FileNotFoundError, "none.tif.*\nhint: check the path", tmp_path / "none.tif", {}),
        (ValueError, "there is no band 7.*\nhint: name one that is there", file, {"band": 7}),
        (ValueError, "invalid value 'bnd=1' .*supported are raw=", file, {"bnd": 1}),
        (ValueError, "m, ft, us-ft", file, {"height_unit": "furlong"}),
        (ValueError, "cannot be used with", file, {"cell_mm": 1, "scale": 2}),
        (ValueError, 'use ground per millimetre, as "100 m/mm"', file, {"scale": "100"}),
        (ValueError, "a cell of -1 mm", file, {"cell_mm": -1}),
        (ValueError, "-1 ground metres per device millimetre", file, {"scale": -1}),
        (ValueError, "hint: choose another --exaggeration", file, {"exaggeration": 0}),
        (ValueError, "heights reach .* cells", file, {"exaggeration": 1e9}),
    ]:
        with pytest.raises(error, match=f"(?s){text}") as raised:
            Terrain.open(path, **words)
        assert not str(raised.value).startswith("error") and "Usage" not in str(raised.value)
    (tmp_path / "text.tif").write_text("no terrain")
    with pytest.raises(ValueError, match="hint"):
        Terrain.open(tmp_path / "text.tif")


def test_notes_are_warnings(tmp_path):
    file = written(tmp_path / "d.tif", transform=DEGREES, crs="EPSG:4326")
    with rasterio.open(file, "r+") as ds:
        ds.set_band_unit(1, "")
    with pytest.warns(UserWarning, match="does not state the unit of its heights"):
        Terrain.open(file)


def test_damaged_parts_are_holes_and_warnings(tmp_path):
    heights = np.random.default_rng(3).uniform(0, 100, (256, 256)).astype("f4")
    tiled = dict(tiled=True, blockxsize=64, blockysize=64, compress="deflate")
    file = written(tmp_path / "hills.tif", heights, **tiled)
    content = bytearray(file.read_bytes())
    content[4064:8000] = bytes(8000 - 4064)
    file.write_bytes(content)
    with pytest.warns(UserWarning, match="cannot be read and count as no data"):
        assert Terrain.open(file, in_memory=0).height_mm(30, 230) is None


@pytest.mark.parametrize(
    "touch",
    [
        lambda terrain, place: terrain.height_mm(*place),
        lambda terrain, place: Contact(terrain).step((*place, 5)),
        lambda terrain, place: Contact(terrain).run([(*place, 5)]),
    ],
    ids=["height", "step", "run"],
)
def test_deleted_parts_are_warnings(tmp_path, touch):
    file = huge(tmp_path)
    terrain = Terrain.open(file, raw=f"{SIDE}x{SIDE}", cell="1m")
    os.truncate(file, 1000)
    with pytest.warns(UserWarning, match="cannot be read and count as no data"):
        touch(terrain, (1000.5, 1000.5))


#: Samples along a side: 20 GB.
SIDE = 100_000


def huge(folder):
    """Creates a sparse file of samples, with only 400 × 400 near the south-west corner on the
    disk."""
    file = folder / "huge.raw"
    with file.open("wb") as raw:
        raw.truncate(2 * SIDE * SIDE)
        for row in range(SIDE - 1200, SIDE - 800):
            raw.seek(2 * (row * SIDE + 900))
            raw.write(np.full(400, 3, "<i2").tobytes())
    return file


def test_terrain_larger_than_memory_is_read_where_it_is_touched(tmp_path):
    file = huge(tmp_path)
    code = f"""
import resource, hapterra
terrain = hapterra.Terrain.open({str(file)!r}, raw="{SIDE}x{SIDE}", cell="1m")
contact = hapterra.Contact(terrain)
contact.step((1000, 1000, 4))
print(contact.step((1000, 1000, 2.5)).force_n, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    force, kilobytes = told.stdout.rsplit(" ", 1)
    assert force == "(0.0, 0.0, 0.25)", told
    assert int(kilobytes) < 1_000_000


def test_window_is_the_ground_round_a_place(tmp_path):
    whole = Terrain.open(written(tmp_path / "hills.tif"), cell_mm=0.5)
    at = (501_800, 3_998_400)
    window = whole.place(at, size_mm=(20, 10))
    assert window.size_mm == (20, 10) and window.cell_mm == 0.5
    x, y = window.ground_at(0, 0)
    assert ((x - 500_015) % 30, (y - 3_999_985) % 30) == pytest.approx((0, 0), abs=1e-6)
    assert window.mm_at(*at) == pytest.approx((10, 5), abs=0.26)
    for mm in [(0, 0), (3.3, 7.1), (19.9, 9.9)]:
        there = whole.mm_at(*window.ground_at(*mm))
        assert window.height_mm(*mm) == pytest.approx(whole.height_mm(*there), rel=1e-3)
    assert window.height_mm(20.1, 5) is None
    finer = whole.place(at, size_mm=(20, 10), scale="15 m/mm", exaggeration=2)
    assert finer.cell_mm == pytest.approx(2, rel=1e-3) and finer.shape == (6, 11)
    assert finer.height_mm_per_unit == pytest.approx(2 / 15, rel=1e-9)
    # From one window to another, with its size.
    assert finer.place(at, size_mm=(6, 6)).height_mm_per_unit == finer.height_mm_per_unit


def test_cells_of_a_window_are_true_at_its_place(tmp_path):
    heights = np.add.outer(np.zeros(3600), 0.1 * np.arange(240)).astype("f4")
    transform = rasterio.Affine(1 / 360, 0, 7.6, 0, -1 / 360, 60.0)
    file = written(tmp_path / "d.tif", heights, transform, "EPSG:4326")
    whole = Terrain.open(file, scale="30 m/mm")
    for latitude in (51.0, 59.0):
        window = whole.place((7.9, latitude), size_mm=(60, 60))
        east, north = window.mm_at(7.9, latitude)
        assert window.ground_at(east, north) == pytest.approx((7.9, latitude), abs=1e-9)
        # A degree of longitude, mm, and 36 m of height.
        metres = 111_320 * np.cos(np.radians(latitude))
        assert window.mm_at(8.9, latitude)[0] - east == pytest.approx(metres / 30, rel=4e-3)
        rise = window.height_mm(east + 10, north) - window.height_mm(east, north)
        assert rise == pytest.approx(10 * 36 / metres, rel=4e-3)
    assert whole.place((7.9, 59), size_mm=(60, 60)).cell_mm < whole.place((7.9, 51), size_mm=(9, 9)).cell_mm


def test_window_begins_where_its_contact_does(tmp_path):
    whole = Terrain.open(written(tmp_path / "hills.tif"), cell_mm=0.5)
    window = whole.place((501_800, 3_998_400), size_mm=(40, 30))
    height = window.height_mm(15, 12)
    contact = Contact(window)
    contact.step((15, 12, height + 3))
    step = contact.step((15, 12, height - 1))
    assert step.state == State.TOUCHING and step.force_n[2] > 0.2
    assert Contact(window).step((45, 12, height - 1)).state == State.OUTSIDE


def test_window_ends_with_the_terrain(tmp_path):
    whole = Terrain.open(written(tmp_path / "hills.tif"), cell_mm=1)
    corner = whole.place(whole.ground_at(1, 2), size_mm=(20, 20))
    assert corner.ground_at(0, 0) == pytest.approx(whole.ground_at(0, 0))
    assert corner.size_mm == (11, 12)
    assert whole.place(whole.ground_at(60, 40), size_mm=(1e9, 1e9)).shape == whole.shape


def test_places_are_also_longitude_and_latitude(tmp_path):
    terrain = Terrain.open(written(tmp_path / "hills.tif"), cell_mm=1)
    lonlat = terrain.ground_at(40, 30, crs="lonlat")
    assert lonlat == pytest.approx((15.0, 36.1), abs=0.1)
    assert terrain.mm_at(*lonlat, crs="lonlat") == pytest.approx((40, 30), abs=1e-3)
    assert terrain.place(lonlat, "lonlat", size_mm=(9, 9)).mm_at(*lonlat, "lonlat") == pytest.approx(
        (4.5, 4.5), abs=0.51
    )
    unplaced = np.save(tmp_path / "hills.npy", hills()) or Terrain.open(tmp_path / "hills.npy")
    assert unplaced.mm_at(3, 4) == (3, 4)
    for call in (lambda: unplaced.mm_at(7, 45, "lonlat"), lambda: unplaced.ground_at(7, 45, "lonlat")):
        with pytest.raises(ValueError, match="hint: state the place in the file's own coordinates"):
            call()
    with pytest.raises(ValueError, match="crs is 'EPSG:4326': use \"lonlat\""):
        terrain.mm_at(7, 45, "EPSG:4326")


def test_impossible_places_are_errors(tmp_path):
    heights = (30 * hills()).astype("f4")
    heights[40:60, 40:60] = np.nan
    terrain = Terrain.open(written(tmp_path / "hills.tif", heights))
    for at, size, text in [
        ((0, 0), (9, 9), "outside of the terrain, which covers"),
        ((501_500, 3_998_500), (9, 9), "there is no data at"),
        ((500_100, 3_999_000), (0, 9), "size_mm is"),
        ((500_100, 3_999_000), (9, np.nan), "size_mm is"),
        ((500_100,), (9, 9), "at has 1 numbers: pass 2"),
    ]:
        with pytest.raises(ValueError, match=text):
            terrain.place(at, size_mm=size)


@pytest.mark.parametrize("flip", [False, True])
def test_arrays_with_coordinates_have_places(tmp_path, flip):
    transform, heights = UTM, (30 * hills()).astype("f4")
    if flip:
        transform, heights = rasterio.Affine(30, 0, 500_000, 0, 30, 3_997_090), heights[::-1]
    with rasterio.open(written(tmp_path / "hills.tif", heights, transform)) as ds:
        array = Terrain.from_rasterio(ds, cell_mm=0.5)
    opened = Terrain.open(written(tmp_path / "upper.tif"), cell_mm=0.5)
    at = (501_800, 3_998_400)
    assert array.mm_at(*at) == pytest.approx(opened.mm_at(*at))
    assert array.ground_at(3, 4) == pytest.approx(opened.ground_at(3, 4))
    for how in ({}, {"cell_mm": 0.25, "exaggeration": 3}, {"scale": "40 m/mm"}):
        one, other = (it.place(at, size_mm=(20, 10), **how) for it in (array, opened))
        assert one.shape == other.shape
        assert one.ground_at(0, 0) == pytest.approx(other.ground_at(0, 0))
        assert one.height_mm(3.3, 4.4) == pytest.approx(other.height_mm(3.3, 4.4), rel=2e-3)
    for bad, text in [((0, 0), "outside"), (at, "size_mm")]:
        with pytest.raises(ValueError, match=text):
            array.place(bad, size_mm=(0, 5))
    with pytest.raises(ValueError, match="use Terrain.open"):
        array.mm_at(*at, crs="lonlat")
    with pytest.raises(ValueError, match="an array without coordinates"):
        Terrain(hills(), cell_mm=1).place(at, size_mm=(9, 9))
