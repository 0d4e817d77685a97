"""The virtual arm, and the example that runs on it."""

import runpy
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from hapterra import ARM_STEP, Contact, State, Surface, Terrain, VirtualArm

EXAMPLES = Path(__file__).parent.parent / "examples"
LEVEL = Terrain(np.zeros((101, 101)), cell_mm=1.0)
#: From above, down to press, 40 mm eastward.
STROKE = [(30, 50, 5), (30, 50, -5), (70, 50, -5)]


def run_stroke(arm=None, corners=STROKE, **surface):
    contact, t = Contact(LEVEL, Surface(**surface)), np.arange(0, 1.5005, 0.001)
    targets = np.column_stack([np.interp(t, [0.0, 0.3, 1.5], axis) for axis in zip(*corners)])
    return (arm or VirtualArm((50, 50, 10))).run(contact, targets, t)


def test_hand_presses_with_the_force_of_its_springs():
    steps = run_stroke(corners=[STROKE[0], STROKE[1], STROKE[1]])
    assert steps.dtype == ARM_STEP and len(steps) == 1501
    assert np.array_equal(steps["tick"], np.arange(1501))
    first, last = steps[0], steps[-1]
    assert np.abs(first["hip_mm"] - STROKE[0]).max() < 0.1 and first["state"] == State.FREE
    # Springs in series: surface 0.5, grip 2, arm 0.3 N/mm, and 5 mm; the joints' friction takes a
    # part.
    expected = 5 / (1 / 0.5 + 1 / 2 + 1 / 0.3)
    assert last["state"] == State.TOUCHING and abs(last["force_n"][2] - expected) < 0.15
    assert last["hand_mm"][2] < last["hip_mm"][2] < last["proxy_mm"][2] == 0


def test_friction_holds_the_hand_back():
    for mu in (0.1, 0.4, 0.8):
        steps = run_stroke(friction=mu)[900:]
        along, across = -steps["force_n"][:, 0], steps["force_n"][:, 2]
        assert abs(np.median(along / across) - mu) < 0.01 * mu
    behind = [70 - run_stroke(friction=mu)["hand_mm"][-1, 0] for mu in (0.0, 0.4, 0.8)]
    assert behind[0] < behind[1] < behind[2]


def test_same_arguments_return_the_same_bits():
    assert run_stroke(friction=0.4).tobytes() == run_stroke(friction=0.4).tobytes()
    weak = VirtualArm((50, 50, 10), arm_stiffness=150, hand_mass=0.3)
    assert run_stroke(weak)["force_n"][-1, 2] < 0.8 * run_stroke()["force_n"][-1, 2]


def test_other_threads_work_while_the_arm_moves():
    counts, ended = [0], threading.Event()

    def count():
        while not ended.wait(0.001):
            counts[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    run_stroke()
    ended.set()
    thread.join()
    assert counts[0] > 3


def test_impossible_arguments_are_refused():
    with pytest.raises(ValueError, match="cannot reach"):
        run_stroke(corners=[STROKE[0], (30, 900, 5), STROKE[0]])
    with pytest.raises(ValueError, match="hand_mass is 0"):
        VirtualArm((0, 0, 0), hand_mass=0)
    with pytest.raises(ValueError, match="shape"):
        VirtualArm((0, 0, 0)).run(Contact(LEVEL), [1, 2, 3])
    assert len(VirtualArm((0, 0, 0)).run(Contact(LEVEL), np.zeros((0, 3)))) == 0


def test_staircase_finds_the_observers_own_threshold():
    jnd = runpy.run_path(str(EXAMPLES / "friction_jnd.py"))
    expected, found = jnd["own_threshold"](), []
    for seed in range(6):
        random = np.random.default_rng(seed)
        differences, reversals = jnd["staircase"](jnd["simulated"](random), 60, random)
        assert len(differences) == 60
        found.append(jnd["jnd_of"](reversals))
    # The error of one staircase of 60 trials is up to a factor of 2.6 here; that of the mean of six
    # is less.
    assert 1 / 1.3 < np.mean(found) / expected < 1.3, (found, expected)


def test_example_prints_a_jnd_and_saves_a_plot(tmp_path, monkeypatch, capsys):
    out = tmp_path / "jnd.png"
    monkeypatch.setattr(sys, "argv", ["friction_jnd.py", "--trials", "60", "--out", str(out)])
    runpy.run_path(str(EXAMPLES / "friction_jnd.py"), run_name="__main__")
    told = capsys.readouterr().out
    assert "threshold: 0.0231" in told and "Weber fraction" in told
    assert out.stat().st_size > 5000
