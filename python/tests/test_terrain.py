"""Terrains from arrays."""

import numpy as np
import pytest

import hapterra
from hapterra import Contact, Surface, Terrain

RAMP = np.arange(12.0).reshape(3, 4)


def test_origin_sets_the_first_row():
    upper = Terrain(RAMP, cell_mm=2)
    lower = Terrain(RAMP, cell_mm=2, origin="lower")
    assert upper.height_mm(2, 0) == 9 and lower.height_mm(2, 0) == 1
    assert upper.height_mm(2, 4) == 1 and lower.height_mm(2, 4) == 9
    assert upper.size_mm == (6, 4) and upper.shape == (3, 4)
    with pytest.raises(ValueError, match='origin is \'north\': use "upper"'):
        Terrain(RAMP, cell_mm=2, origin="north")


@pytest.mark.parametrize(
    "dtype",
    ["f2", "f4", "f8", "g", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">f8", ">i2", ">u4", "?"],
)
def test_every_real_type_has_the_same_heights(dtype):
    heights = (RAMP % 2).astype(dtype)
    terrain = Terrain(heights, cell_mm=1, height_mm_per_unit=3)
    assert terrain.height_mm(1, 0) == 3 and terrain.height_mm(2.5, 0) == 1.5


@pytest.mark.parametrize(
    "heights",
    [
        np.asfortranarray(RAMP),
        np.ascontiguousarray(RAMP.T).T,
        np.repeat(np.repeat(RAMP, 2, 0), 3, 1)[::2, ::3],
        RAMP[::-1, ::-1].copy()[::-1, ::-1],
        np.frombuffer(b"\0" + RAMP.tobytes(), "u1")[1:].view("f8").reshape(3, 4),
        RAMP.tolist(),
    ],
    ids=["fortran", "transposed", "strided", "reversed", "unaligned", "list"],
)
def test_memory_order_does_not_matter(heights):
    terrain = Terrain(heights, cell_mm=1, origin="lower")
    found = [[terrain.height_mm(x, y) for x in range(4)] for y in range(3)]
    assert found == RAMP.tolist()


def test_terrain_is_a_copy():
    heights = RAMP.copy()
    terrain = Terrain(heights, cell_mm=1, origin="lower")
    heights[:] = 99
    assert terrain.height_mm(1, 0) == 1


@pytest.mark.parametrize("dtype", ["f4", "i2"])
def test_masked_samples_are_holes(dtype):
    masked = np.ma.masked_equal(RAMP.astype(dtype), 0)
    terrain = Terrain(masked, cell_mm=1, origin="lower")
    assert terrain.height_mm(0.5, 0.5) is None and terrain.height_mm(1.5, 0.5) == 3.5
    unmasked = Terrain(np.ma.masked_array(RAMP.astype(dtype)), cell_mm=1, origin="lower")
    assert unmasked.height_mm(0.5, 0.5) == 2.5


def test_nan_is_a_hole_without_force():
    heights = np.zeros((50, 50))
    heights[20:30, 20:30] = np.nan
    contact = Contact(Terrain(heights, cell_mm=1))
    contact.step([5, 5, 1])
    assert contact.step([5, 5, -1]).force_n == (0, 0, 0.5)
    contact = Contact(contact.terrain)
    step = contact.step([25, 25, -1])
    assert (step.state, step.force_n) == (hapterra.State.OUTSIDE, (0, 0, 0))


def test_bad_arrays_are_errors():
    for error, text, heights in [
        (ValueError, r"shape \(3,\): use \(rows, columns\)", [1, 2, 3]),
        (ValueError, r"shape \(2, 2, 2\)", np.zeros((2, 2, 2))),
        (ValueError, "1 × 4 samples|4 × 1 samples", np.zeros((1, 4))),
        (ValueError, "0 × 3 samples|3 × 0 samples", np.zeros((3, 0))),
        (TypeError, "complex128: use real numbers", np.zeros((3, 3), complex)),
        (TypeError, "object", [[1, None], [2, 3]]),
        (TypeError, "<U1", [["1", "2"], ["3", "4"]]),
        (TypeError, "datetime64", np.zeros((2, 2), "M8[s]")),
    ]:
        with pytest.raises(error, match=text):
            Terrain(heights, cell_mm=1)
    for bad in (0, -1, np.nan, np.inf):
        with pytest.raises(ValueError, match="a cell of"):
            Terrain(RAMP, cell_mm=bad)
    with pytest.raises(ValueError, match="for a vertical unit"):
        Terrain(RAMP, cell_mm=1, height_mm_per_unit=np.nan)
    with pytest.raises(TypeError):
        Terrain(RAMP)
    for heights, text in [([[0, 0], [0, 1e5]], "differs from a neighbour"), ([[0, 1e10]] * 2, "scale")]:
        with pytest.raises(ValueError, match=text):
            Contact(Terrain(heights, cell_mm=1))


def test_materials_follow_the_array():
    materials = np.zeros((40, 40), int)
    materials[:, 20:] = 1
    terrain = Terrain(np.ones((40, 40)), cell_mm=0.5, materials=materials)
    contact = Contact(terrain, Surface(materials=[Surface(stiffness=0.1)]))

    def force(east):
        contact.step([east, 5, 3])
        return contact.run([[east, 5, 0]] * 300)["force_n"][-1, 2]

    assert (force(3), force(17)) == (0.5, np.float32(0.1))
    with pytest.raises(ValueError, match="has material 1, and the surface only 1"):
        Contact(terrain)
    for bad in (materials[:5], materials * 99, materials.astype(float), -materials):
        with pytest.raises(ValueError, match="materials"):
            Terrain(np.ones((40, 40)), cell_mm=1, materials=bad)


def test_tip_is_a_ball_by_its_centre():
    point = Terrain(np.zeros((9, 9)), cell_mm=1)
    ball = point.with_tip(2.5)
    assert (point.height_mm(4.2, 4), ball.height_mm(4.2, 4)) == (0, 2.5)
    assert (point.tip_mm, ball.tip_mm, ball.shape) == (0, 2.5, (9, 9))
    assert "tip_mm=2.5" in repr(ball) and "tip" not in repr(point)
    assert ball.with_tip(0).height_mm(4.2, 4) == 0
    steps = Contact(ball).run([[4, 4, 5], [4, 4, 2]])
    assert steps["proxy_mm"][1, 2] == 2.5 and steps["force_n"][1, 2] == 0.25
    for radius in (-1, 8.1, np.nan):
        with pytest.raises(ValueError, match="where 0 to 8 can be rendered"):
            point.with_tip(radius)
