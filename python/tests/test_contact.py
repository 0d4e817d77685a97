"""Steps, paths, times and threads."""

import _thread
import threading
import warnings

import numpy as np
import pytest

from hapterra import STEP, Contact, State, StepError, Surface, Terrain, to_dataframe

FLAT = Terrain(np.full((40, 40), 2.0), cell_mm=0.5)
DOWN = np.c_[np.full((100, 2), 5.0), np.linspace(4, 0, 100)]


def test_spring_pushes_up_by_its_stiffness():
    contact = Contact(FLAT)
    free = contact.step((7.3, 8.1, 4))
    assert (free.state, free.force_n, free.surface_mm) == (State.FREE, (0, 0, 0), None)
    force, proxy, state, _ = contact.step(np.array([7.3, 8.1, 1]))
    assert (force, state, proxy[2]) == ((0, 0, 0.5), State.TOUCHING, 2)


def test_path_beginning_below_ground_is_reported():
    contact = Contact(FLAT)
    below = contact.step([5, 5, 1])
    assert (below.state, below.force_n, below.surface_mm) == (State.BELOW_GROUND, (0, 0, 0), 2)
    assert contact.run([[5, 5, 1]])["state"][0] == State.BELOW_GROUND


def test_run_is_its_steps():
    surface = Surface(friction=0.4, damping=3)
    steps = Contact(FLAT, surface).run(DOWN)
    one = Contact(FLAT, surface)
    assert steps.dtype == STEP and len(steps) == 100
    for row, hip in zip(steps, DOWN):
        step = one.step(hip)
        assert (*row["force_n"], *row["proxy_mm"]) == (*step.force_n, *step.proxy_mm)
        assert row["state"] == step.state and (row["hip_mm"] == hip).all()
    assert np.array_equal(steps["t_s"], np.arange(100) / 1000)
    assert steps.flags.writeable and (steps["state"] == State.TOUCHING).sum() == 50


def test_run_continues_from_the_last_one():
    whole, parts = Contact(FLAT, Surface(friction=0.4)), Contact(FLAT, Surface(friction=0.4))
    path = np.r_[DOWN, DOWN[-1] + np.c_[np.linspace(0, 5, 200), np.zeros((200, 2))]]
    twice = np.r_[parts.run(path[:120]), parts.run(path[120:])]
    assert np.array_equal(whole.run(path)["force_n"], twice["force_n"])
    assert len(parts.run(np.zeros((0, 3)))) == 0


@pytest.mark.parametrize("path", [DOWN.astype("f4"), DOWN[::2], np.asfortranarray(DOWN), DOWN.astype(">f8")])
def test_path_of_any_layout_is_its_numbers(path):
    assert np.array_equal(Contact(FLAT).run(path)["hip_mm"], path)
    assert np.array_equal(Contact(FLAT).run(path.tolist())["hip_mm"], path)


def test_bad_paths_are_errors():
    contact = Contact(FLAT)
    for path in (np.zeros(3), np.zeros((3, 2)), np.zeros((3, 3, 1))):
        with pytest.raises(ValueError, match=r"use \(N, 3\)"):
            contact.run(path)
    with pytest.raises(ValueError, match="t has the shape"):
        contact.run(DOWN, t=[0, 1])
    for hip in ([1, 2], [1, 2, 3, 4], [1, np.nan, 2], [1, 1e300, 2]):
        with pytest.raises(ValueError):
            contact.step(hip)
    with pytest.raises(StepError, match="step 1 of the path: the HIP is at") as error:
        contact.run([[1, 1, 3], [1, np.nan, 1], [1, 1, 1]])
    assert len(error.value.steps) == 1 and error.value.steps.dtype == STEP
    for rate in (1500, 0, 11_000):
        with pytest.raises(ValueError, match="ticks a second: use 1,000 to 10,000"):
            Contact(FLAT, rate=rate)
    with pytest.raises(TypeError, match="hapterra.Terrain"):
        Contact(np.zeros((5, 5)))


def test_times_are_sampled_at_the_tick_rate():
    path = [[1, 7, 5], [5, 7, 5], [4, 7, 5]]
    steps = Contact(FLAT).run(path, t=[2, 2.004, 2.006])
    assert steps["hip_mm"][:, 0] == pytest.approx([1, 2, 3, 4, 5, 4.5, 4])
    assert steps["t_s"] == pytest.approx(2 + np.arange(7) / 1000)
    assert len(Contact(FLAT, rate=4000).run(path, t=[2, 2.004, 2.006])) == 25
    assert len(Contact(FLAT).run(path, t=[3, 3, 3])) == 3


def test_impossible_times_are_errors():
    path = np.array([[1.0, 1, 5], [2, 1, 5], [3, 1, 5]])
    for t, text in [
        ([0, 1, 0.5], r"t\[2\]: time decreases from 1 s to 0.5 s"),
        ([0, 1, 1], r"t\[2\]: two places at 1 s"),
        ([0, 1, 4], r"t\[2\]: the HIP moves during a gap of 3 s"),
        ([0, np.nan, 1], r"t\[1\]: the time is not a finite number"),
        ([1e15, 1e15 + 1, 1e15 + 2], "too far apart to separate ticks"),
    ]:
        with pytest.raises(ValueError, match=text):
            Contact(FLAT).run(path, t)
    with pytest.raises(ValueError, match=r"t\[1\]: a gap of 601 s"):
        Contact(FLAT).run(path[[0, 0]], [0, 601])


def test_odd_times_are_warnings():
    path = np.array([[1.0, 1, 5], [2, 1, 5], [3, 1, 5]])
    with pytest.warns(UserWarning, match="2 times the HIP moves for more than 0.05 s"):
        Contact(FLAT).run(path, [0, 0.1, 0.2])
    with pytest.warns(UserWarning, match="1 of 3 rows lie between two ticks"):
        Contact(FLAT).run(path, [0, 0.0005, 0.001])
    with pytest.warns(UserWarning, match="1 rows repeat"):
        Contact(FLAT).run(path[[0, 0, 1]], [0, 0, 0.001])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Contact(FLAT).run(path, [0, 0.001, 0.002])


def test_dataframe_has_the_names_of_a_replay():
    steps = Contact(FLAT).run(DOWN)
    frame = to_dataframe(steps)
    assert list(frame.columns) == (
        "t_s x_mm y_mm z_mm proxy_x_mm proxy_y_mm proxy_z_mm force_x_n force_y_n force_z_n state"
    ).split()
    assert np.array_equal(frame["force_z_n"], steps["force_n"][:, 2])
    assert list(frame["state"].unique()) == ["free", "touching"]


def test_surface_changes_between_steps():
    contact = Contact(FLAT)
    contact.step([5, 5, 3])
    contact.set_surface(Surface(stiffness=1))
    assert contact.step([5, 5, 1.5]).force_n == (0, 0, 0.5)


def test_other_threads_run_meanwhile():
    # With the interpreter's lock held, no call could overlap the run of the other thread.
    path = np.tile(DOWN, (3000, 1))
    contact = Contact(FLAT)
    done = []
    thread = threading.Thread(target=lambda: done.append(contact.run(path)))
    refused = 0
    thread.start()
    while not done and thread.is_alive():
        try:
            contact.step([5, 5, 4])
        except RuntimeError as error:
            assert "runs in another thread" in str(error)
            refused += 1
    thread.join()
    assert len(done[0]) == len(path)
    assert refused > 0


def test_ctrl_c_ends_a_run():
    # Rests of 500 s in the air are a million ticks; the last rows are a contact that friction holds.
    path = [[5, 5, 4]] * 3 + [[5, 5, 1]]
    contact = Contact(FLAT, Surface(friction=5))
    contact.run(path[:1])
    ended = []

    def interrupt():
        while not ended:
            try:
                contact.step([5, 5, 4])
            except RuntimeError:
                return _thread.interrupt_main()

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        contact.run(path, [0, 500, 1000, 1000.001])
        ended.append(True)
    thread.join()
    # From the path's end the proxy would not follow; from the air it meets the ground half-way.
    assert contact.step([6, 5, 1]).proxy_mm[0] > 5.3
