"""Recordings: their content and their replay."""

import numpy as np
import pytest
from test_open import written
from test_replay import CELL_MM, FLAGS, hills, stroke

from hapterra import CommandError, read_recording
from hapterra._command import run

LATER = """# [[view]]
# number = 1
# level = 0
# cell_mm = 0.5
# height_mm_per_unit = 0.5
# home_mm = [20.0, 10.0, 5.0]
# stiffness_n_per_mm = 0.4
# max_force_n = 8.5
# [[mark]]
# tick = 3
# t_s = 0.003
# host_unix_s = 1764226800.5
# text = "left, \\"2\\""
"""


@pytest.fixture
def recorded(tmp_path):
    """Returns recordings of the same path over hills, CSV and Parquet."""
    file = written(tmp_path / "hills.tif")
    path = tmp_path / "path.csv"
    np.savetxt(path, stroke(3_000), delimiter=",", header="x_mm,y_mm,z_mm", comments="", fmt="%.17g")
    words = [f"--scale={CELL_MM}mm/cell", *FLAGS, file, path]
    for form in ("csv", "parquet"):
        run("replay", *words, "-o", tmp_path / f"felt.{form}")
    return tmp_path / "felt.csv", tmp_path / "felt.parquet"


def test_both_forms_have_the_same_columns(recorded):
    csv, parquet = map(read_recording, recorded)
    assert csv.steps.dtype == parquet.steps.dtype
    assert csv.steps.dtype.names[:4] == ("t_s", "x_mm", "y_mm", "z_mm")
    assert len(csv.steps) == 3_000 and csv.settings == parquet.settings
    for name in csv.steps.dtype.names:
        assert np.array_equal(csv.steps[name], parquet.steps[name]), name
    assert csv.steps["contact"].dtype == "i8" and csv.steps["force_z_n"].dtype == "f8"
    assert "touching" in set(csv.steps["state"])


def test_settings_are_the_recorded_ones(recorded):
    for recording in map(read_recording, recorded):
        settings = recording.settings
        assert settings["terrain"]["file"].endswith("hills.tif")
        assert settings["felt"]["cell_mm"] == CELL_MM
        assert settings["force"]["friction"]["static_mu"] == 0.5
        assert settings["device"]["tick_hz"] == 1000
        frame = recording.to_dataframe()
        assert frame.attrs == settings and list(frame.columns) == list(recording.steps.dtype.names)
        assert (recording.marks, recording.views) == ([], [])
        assert "3000 steps on" in repr(recording)


def test_replay_without_changes_is_the_recording(recorded, tmp_path):
    for recording in map(read_recording, recorded):
        again = recording.replay()
        assert (again.steps == recording.steps).all()
        kept = again.replay(output=tmp_path / "again.csv")
        assert (kept.steps == recording.steps).all()
        assert kept.path == str(tmp_path / "again.csv")


def test_replay_with_changes_is_another(recorded):
    recording = read_recording(recorded[0])
    smooth = recording.replay(friction=0.1, surface="ice")
    assert smooth.settings["force"]["friction"]["dynamic_mu"] == pytest.approx(0.1)
    assert "texture" not in smooth.settings["force"]
    assert not np.array_equal(smooth.steps["force_x_n"], recording.steps["force_x_n"])
    with pytest.raises(CommandError, match="friction") as failed:
        recording.replay(friction=-1)
    assert failed.value.hint.startswith("friction from 0")


def test_replay_is_on_the_terrain_that_was_recorded(recorded, tmp_path):
    recording = read_recording(recorded[0])
    other = written(tmp_path / "other.tif", (2 * hills()).astype("f4"))
    with pytest.raises(CommandError, match="is not the terrain of this recording"):
        recording.replay(other)
    flat = recording.replay(other, ignore_settings=True, scale=f"{CELL_MM}mm/cell")
    assert flat.settings["terrain"]["file"] == str(other)


def test_views_and_marks_are_reported(recorded, tmp_path):
    text = recorded[0].read_text("utf-8")
    lines = text.splitlines(keepends=True)
    first = next(n for n, line in enumerate(lines) if not line.startswith("#"))
    (tmp_path / "views.csv").write_text("".join([*lines[: first + 9], LATER, *lines[first + 9 :]]))
    recording = read_recording(tmp_path / "views.csv")
    assert len(recording.steps) == 3_000
    [view] = recording.views
    assert (view["number"], view["home_mm"]) == (1, [20, 10, 5])
    mark = {"tick": 3, "t_s": 0.003, "host_unix_s": 1764226800.5, "text": 'left, "2"'}
    assert recording.marks == [mark]


def test_cut_row_is_skipped_with_a_warning(recorded, tmp_path):
    text = recorded[0].read_text("utf-8")
    (tmp_path / "cut.csv").write_text(text[: text.rindex(",") - 8])
    with pytest.warns(UserWarning, match="cut in the middle"):
        recording = read_recording(tmp_path / "cut.csv")
    assert len(recording.steps) == 2_999


def test_other_files_are_errors(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_recording(tmp_path / "none.csv")
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="is not the header of a trajectory.*\nhint: "):
        read_recording(tmp_path / "other.csv")
    (tmp_path / "short.csv").write_text("t_s,x_mm,y_mm,z_mm\n0,1,2,3\n1,2\n2,1,2,3\n")
    with pytest.raises(ValueError, match="row 2 has 2 columns where the header has 4"):
        read_recording(tmp_path / "short.csv")
    (tmp_path / "path.csv").write_text("t_s,x_mm,y_mm,z_mm,trial,note\n0,1,2,3,1,a\n0.001,1,2,3,2.5,b")
    path = read_recording(tmp_path / "path.csv")
    assert path.settings == {} and len(path.steps) == 2
    assert list(path.steps["trial"]) == [1, 2.5] and list(path.steps["note"]) == ["a", "b"]
    with pytest.raises(ValueError, match="does not name its terrain"):
        path.replay()
