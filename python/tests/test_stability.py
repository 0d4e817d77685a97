"""The map of stability, by the program in HAPTERRA_LAB."""

import os
import sys

import numpy as np
import pytest

import hapterra
from hapterra import CommandError, stability


needs_lab = pytest.mark.skipif(
    "HAPTERRA_LAB" not in os.environ, reason="cargo xtask python --test names hapterra-lab"
)


@needs_lab
def test_trials_match_the_request():
    trials = stability(rate=1000, stiffness=[0.5, 20], passivity="off", arm_friction=0.1, delay_us=200)
    assert set(trials["stiffness_n_per_mm"]) == {0.5, 20}
    assert set(trials["tick_hz"]) == {1000} and set(trials["controller"]) == {False}
    assert set(trials["texture"]) == {"none"}
    soft, hard = (trials[trials["stiffness_n_per_mm"] == it]["swing_mm"] for it in (0.5, 20))
    assert soft.max() < 0.1 and not hard.max() < soft.max()
    assert "1000 Hz" in trials.attrs["summary"] or "1 kHz" in trials.attrs["summary"]


@needs_lab
def test_bad_numbers_have_the_text_of_the_command():
    with pytest.raises(CommandError, match="a stiffness from 0.001 to 100 N/mm"):
        stability(stiffness=[0.5, -1])
    with pytest.raises(CommandError, match="unexpected argument '--stifness'"):
        stability(stifness=1)


def test_error_of_missing_program_names_its_installation(monkeypatch):
    monkeypatch.delenv("HAPTERRA_LAB", raising=False)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(CommandError, match="cargo install --locked --path bench --bin hapterra-lab"):
        stability()


def test_error_without_pandas_names_the_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="to_dataframe returns a DataFrame: pip install pandas"):
        hapterra.to_dataframe(np.zeros(0, hapterra.STEP))
    with pytest.raises(ImportError, match="stability returns a DataFrame: pip install pandas"):
        hapterra.stability()
