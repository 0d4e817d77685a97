"""Surfaces."""

import pytest

from hapterra import Surface


def test_defaults_are_those_of_the_library():
    assert repr(Surface()) == (
        "Surface(stiffness=0.5, max_force=8.5, friction=0, static_friction=0, viscous_friction=0, "
        "damping=0, shading='none', texture='none')"
    )
    assert Surface() == Surface(stiffness=0.5) != Surface(stiffness=0.6)


def test_repr_makes_the_same_surface():
    surface = Surface(
        stiffness=0.4,
        max_force=6,
        friction=0.3,
        static_friction=0.5,
        viscous_friction=0.004,
        damping=2,
        shading="smooth",
        texture="grating",
        texture_wavelength=1.5,
        texture_direction=30,
        texture_seed=7,
    )
    assert eval(repr(surface)) == surface
    assert "texture_amplitude=0.15" in repr(surface)
    assert "materials=[2 more]" in repr(Surface(materials=[surface, Surface()]))


def test_static_friction_is_friction_unless_passed():
    assert Surface(friction=0.3) == Surface(friction=0.3, static_friction=0.3)


def test_bad_parameters_are_named():
    for params, text in [
        ({"stiffness": -1}, "stiffness, N/mm, is -1: use 0 to"),
        ({"max_force": float("nan")}, "max_force, N, is NaN"),
        ({"friction": 11}, "dynamic friction is 11: use 0 to 10"),
        ({"friction": 0.5, "static_friction": 0.4}, "static friction is never less"),
        ({"viscous_friction": 2}, "viscous friction, s, is 2: use 0 to 1"),
        ({"damping": 21}, "damping, N·s/m, is 21: use 0 to 20"),
        ({"texture": "grain", "texture_wavelength": 0}, "wavelength, mm, is 0: use 0.25 to 100"),
        ({"shading": "phong"}, 'shading is "phong": use "none" or "smooth"'),
        ({"texture": "sand"}, 'texture is "sand": use "none" or "grain" or "grating"'),
        ({"materials": [Surface()] * 16}, "16 materials besides the surface itself"),
    ]:
        with pytest.raises(ValueError) as error:
            Surface(**params)
        assert text in str(error.value)
    with pytest.raises(TypeError):
        Surface(0.5)
    with pytest.raises(TypeError, match="stifness"):
        Surface(stifness=0.5)
