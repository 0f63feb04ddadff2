"""Photoreceptors: Eq. 2 by hand, fields, mirror images, densities."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.eyes.layout import CONES, FIELD_DEG, LAYOUTS, layout, log_polar, rays_at

COUNTS = {"log_polar": 3600, "uniform": 3600, "sketching": 9936, "cone_density": 3600}


class Silent:
    """A generator whose noise is zero."""

    def normal(self, mean, deviation, shape):
        assert mean == 0.0 and deviation == pytest.approx(0.05)  # variance 0.0025
        return np.zeros(shape)


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_receptors_are_as_many_as_told_and_lie_in_the_field(name, side):
    retina = layout(name, side, 7)
    assert retina.directions.shape == (COUNTS[name], 3) and retina.name == name
    assert np.allclose(np.linalg.norm(retina.directions, axis=1), 1)
    assert np.rad2deg(retina.eccentricity).max() <= FIELD_DEG / 2 + 1e-9
    assert np.rad2deg(retina.eccentricity).max() > 0.97 * FIELD_DEG / 2
    assert retina.width == (9936 if name == "sketching" else 10800)


def test_log_polar_rings_are_those_of_equation_2_with_rho_in_tenths():
    retina = log_polar(Silent())
    angle = np.rad2deg(retina.eccentricity).reshape(40, 90)
    assert np.allclose(angle, angle[:, :1])  # each ring at one angle
    # (e^0.1 - 1) / (e^4 - 1) = 0.1051709 / 53.59815 of 83.75 degrees is 0.164335
    assert angle[0, 0] == pytest.approx(0.164335, abs=1e-5)
    # (e^2 - 1) / (e^4 - 1) = 6.389056 / 53.59815 of 83.75 degrees is 9.98318
    assert angle[19, 0] == pytest.approx(9.98318, abs=1e-4)
    assert angle[39, 0] == pytest.approx(83.75)
    turn = np.rad2deg(np.unwrap(np.arctan2(retina.directions[90:180, 1], retina.directions[90:180, 2])))
    assert np.allclose(np.diff(turn), 4.0)  # alpha in steps of 4 degrees
    assert (np.diff(angle[:, 0], 2) > 0).all()  # ever sparser from the fovea outwards


def test_noise_has_its_variance_in_the_units_of_equation_2():
    unit = 83.75 / 53.59815  # degrees
    quiet, noisy = log_polar(Silent()), layout("log_polar", "left", 3)
    moved = (noisy.retina_deg - quiet.retina_deg)[:-90] / unit  # the last ring is kept within the field
    assert moved.var() == pytest.approx(0.0025, rel=0.05) and abs(moved.mean()) < 0.002


def test_eyes_differ_and_repeat():
    left, right = (layout("log_polar", side, 7).directions for side in ("left", "right"))
    assert np.array_equal(left, layout("log_polar", "left", 7).directions)
    assert not (left == right).all(axis=1).any()
    assert not np.array_equal(left, layout("log_polar", "left", 8).directions)
    assert np.abs(left - right).max() < np.deg2rad(1.0)  # the same grid


def test_lower_right_of_the_world_is_upper_left_on_the_retina():
    """Nakada 2018, Sec. 6.2.1."""
    retina = layout("log_polar", "left", 7)
    right_below = (retina.directions[:, 1] < -0.2) & (retina.directions[:, 2] < -0.2)
    place = retina.retina_deg[right_below]
    assert right_below.any() and (place[:, 0] < 0).all() and (place[:, 1] > 0).all()
    assert np.allclose(np.hypot(*retina.retina_deg.T), np.rad2deg(retina.eccentricity))


@given(st.floats(0.0, np.pi / 2), st.floats(-np.pi, np.pi))
def test_mirrored_rays_lie_mirrored_on_the_retina(angle, turn):
    ray, mirrored = rays_at(np.array([angle, angle]), np.array([turn, -turn]))
    assert np.allclose(ray * [1, -1, 1], mirrored)
    assert ray[0] == pytest.approx(np.cos(angle))


def test_uniform_receptors_are_as_many_in_equal_solid_angles():
    height = layout("uniform", "right", 7).directions[:, 0]
    edges = np.linspace(np.cos(np.deg2rad(FIELD_DEG / 2)), 1, 7)  # zones of equal height have equal areas
    counts, _ = np.histogram(height, edges)
    assert np.allclose(counts, 600, atol=30)


def test_cone_density_falls_as_measured():
    angle = np.rad2deg(layout("cone_density", "left", 7).eccentricity)

    def density(low, high):
        area = 2 * np.pi * (np.cos(np.deg2rad(low)) - np.cos(np.deg2rad(high)))
        return ((angle >= low) & (angle < high)).sum() / area

    # 1 mm is 3.33 degrees, 10 mm is 33.3 degrees.
    measured = np.mean(CONES, axis=0)[6] / np.mean(CONES, axis=0)[11]
    assert density(2.8, 3.9) / density(30, 37) == pytest.approx(measured, rel=0.25)


def test_bad_input_is_told():
    with pytest.raises(UserError, match="unknown retina 'compound'; known: log_polar"):
        layout("compound", "left", 7)
    with pytest.raises(UserError, match="unknown side 'third'"):
        layout("log_polar", "third", 7)
    with pytest.raises(UserError, match="negative"):
        layout("log_polar", "left", -1)
