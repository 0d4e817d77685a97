"""Runs are equal to those of the command ``hapterra replay`` on the same heights, bit for bit."""

import csv
import pathlib

import numpy as np
import pytest

from hapterra import Contact, State, Surface, Terrain
from hapterra._command import run

CELL_MM = 0.7
NAMES = {
    "free": {State.FREE},
    "touching": {State.TOUCHING},
    "releasing": {State.RELEASING},
    "unseeded": {State.BELOW_GROUND, State.OUTSIDE},
}
ROUGH = dict(
    stiffness=0.4,
    max_force=6,
    friction=0.3,
    static_friction=0.5,
    viscous_friction=0.004,
    damping=2,
    shading="smooth",
    texture="grain",
    texture_amplitude=0.1,
    texture_wavelength=1.5,
    texture_seed=3,
)
FLAGS = [f"--surface={pathlib.Path(__file__).with_name('rough.toml')}", "--max-force=6"]


def hills():
    """Returns rough hills with no-data."""
    y, x = np.mgrid[0:97.0, 0:130.0]
    heights = 6 * np.sin(0.21 * x) * np.cos(0.13 * y) + 0.4 * np.sin(2.1 * x + 1.3 * y)
    heights.flat[::997] = np.nan
    return heights


def stroke(rows):
    """Returns the path of a hand over the hills and through them."""
    at = np.arange(rows) * 0.01
    return np.c_[
        45 + 40 * np.sin(0.21 * at), 33 + 30 * np.sin(0.33 * at + 1), 7 - 8 * np.sin(0.05 * at + 5) ** 2
    ]


def replayed(folder, heights, path, t=None, words=()):
    """Returns the command's output for an array or a file."""
    ground = heights
    if isinstance(heights, np.ndarray):
        ground = folder / "hills.npy"
        np.save(ground, heights)
    columns = {} if t is None else {"t_s": t}
    columns |= dict(zip(("x_mm", "y_mm", "z_mm"), path.T))
    # With the shortest digits that read back to the same value, as in the command's output.
    rows = zip(*(column.tolist() for column in columns.values()))
    with (folder / "path.csv").open("w", newline="") as file:
        csv.writer(file).writerows([columns, *rows])
    files = [ground, folder / "path.csv", "-o", folder / "felt.csv"]
    run("replay", *files, *words)
    with (folder / "felt.csv").open(newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {name: [row[name] for row in rows] for name in rows[0]}


def same(steps, columns):
    """Fails unless they are equal, bit for bit. Returns the number of touching steps."""
    assert len(steps) == len(columns["t_s"])
    assert np.array_equal(steps["t_s"], np.array(columns["t_s"], float))
    touching = steps["state"] == State.TOUCHING
    for field, name in (("hip_mm", "{}_mm"), ("proxy_mm", "proxy_{}_mm"), ("force_n", "force_{}_n")):
        for axis, letter in enumerate("xyz"):
            found = steps[field][:, axis]
            expected = np.array(columns[name.format(letter)], float).astype(found.dtype)
            # Without contact the file has the HIP, rounded, in place of the proxy.
            differ = found != expected if field != "proxy_mm" else touching & (found != expected)
            rows = np.flatnonzero(differ)
            assert not len(rows), f"{field} {letter}: {len(rows)} rows from {rows[0]} on"
    for name, state in zip(columns["state"], steps["state"]):
        assert State(state) in NAMES[name]
    return touching.sum()


@pytest.mark.parametrize("surface, flags", [({}, []), (ROUGH, FLAGS)], ids=["ice", "rough"])
def test_run_is_a_replay(tmp_path, surface, flags):
    path = stroke(20_000)
    columns = replayed(tmp_path, hills(), path, words=[f"--scale={CELL_MM}mm/cell", *flags])
    contact = Contact(Terrain(hills(), cell_mm=CELL_MM), Surface(**surface))
    touching = same(contact.run(path), columns)
    assert 2_000 < touching < 18_000, touching


@pytest.mark.parametrize("tip_mm", [1, 2, 8 * CELL_MM])
def test_run_under_a_tip_is_a_replay(tmp_path, tip_mm):
    path = stroke(20_000) + [0, 0, tip_mm]
    words = [f"--scale={CELL_MM}mm/cell", f"--tip={tip_mm}mm", *FLAGS]
    columns = replayed(tmp_path, hills(), path, words=words)
    terrain = Terrain(hills(), cell_mm=CELL_MM).with_tip(tip_mm)
    touching = same(Contact(terrain, Surface(**ROUGH)).run(path), columns)
    assert 2_000 < touching < 18_000, touching


def test_integers_at_a_scale_are_a_replay(tmp_path):
    heights = np.nan_to_num(hills() * 9).astype(">i2")
    path = stroke(20_000) * [0.42, 0.42, 0.2]
    words = ["--scale=0.3mm/cell", "--exaggeration=0.017mm/unit"]
    columns = replayed(tmp_path, heights, path, words=words)
    terrain = Terrain(np.asfortranarray(heights), cell_mm=0.3, height_mm_per_unit=0.017)
    assert same(Contact(terrain).run(path), columns) > 1_000


@pytest.mark.filterwarnings("ignore:.* rows:UserWarning")
@pytest.mark.parametrize("hz", [90.0, 1000.0, 3333.3])
@pytest.mark.parametrize("begin_s", [0.0, 1_767_225_600.0])
def test_times_are_those_of_a_replay(tmp_path, hz, begin_s):
    rows = 4_000
    random = np.random.default_rng(7)
    t = begin_s + (np.arange(rows) + random.uniform(-0.4, 0.4, rows)) / hz
    # Every third row is next to a tick, and rows may repeat.
    t[::3] = begin_s + np.round((t[::3] - begin_s) * 1000 + 0.009 * random.uniform(-1, 1)) / 1000
    path = stroke(rows) + [0, 0, -2]
    repeat = np.sort(np.r_[np.arange(rows), [5, 700]])
    t, path = np.maximum.accumulate(t)[repeat], path[repeat]
    path = path[np.r_[True, (np.diff(t) > 0) | (np.diff(path, axis=0) == 0).all(1)]]
    t = t[np.r_[True, (np.diff(t) > 0) | (np.diff(repeat) == 0)]]
    columns = replayed(tmp_path, hills(), path, t, [f"--scale={CELL_MM}mm/cell", *FLAGS])
    steps = Contact(Terrain(hills(), cell_mm=CELL_MM), Surface(**ROUGH)).run(path, t)
    same(steps, columns)
    assert abs(len(steps) - 1000 * (t[-1] - t[0])) < 2


def test_one_time_for_all_rows_is_a_replay(tmp_path):
    path = stroke(3_000)
    t = np.full(3_000, 4.5)
    columns = replayed(tmp_path, hills(), path, t, [f"--scale={CELL_MM}mm/cell"])
    same(Contact(Terrain(hills(), cell_mm=CELL_MM)).run(path, t), columns)
