"""What networks look at: derivatives against differences, and receptors that count."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.eyes.saliency import FULL, gradients, saliency
from anthro.motor.network import FeedForward


def network(seed, sizes=(6, 9, 8, 2), soft=False):
    rng = np.random.default_rng(seed)
    shapes = list(zip(sizes[1:], sizes[:-1], strict=True))
    matrices = [rng.normal(0, 0.7, shape) for shape in shapes]
    biases = [rng.normal(0, 0.3, out) for out, _ in shapes]
    scales = {
        "input_mean": rng.normal(0, 1, sizes[0]),
        "input_scale": rng.uniform(0.5, 2, sizes[0]),
        "output_mean": rng.normal(0, 0.2, sizes[-1]),
        "output_scale": rng.uniform(0.2, 0.5, sizes[-1]),
    }
    if soft:
        scales |= {"input_softening": np.array([0.5, 0, 2, 0, 1, 0]), "output_softening": np.array([0.3, 0])}
    return FeedForward(matrices, biases, scales)


@given(seed=st.integers(0, 40), soft=st.booleans())
def test_derivatives_are_those_of_small_differences(seed, soft):
    net = network(seed, soft=soft)
    x = np.random.default_rng(seed + 1).normal(0, 2, (3, 6))
    found, step = gradients(net, x), 2e-3
    for column in range(6):
        aside = step * np.eye(6)[column]
        ahead, back = (net.predict(x + sign * aside).astype(float) for sign in (1, -1))
        middle = net.predict(x).astype(float)
        near, far = (ahead - middle) / step, (middle - back) / step
        smooth = np.abs(near - far) < 0.02 * (1 + np.abs(near))  # no unit turns on or off in between
        difference = (ahead - back) / (2 * step)
        np.testing.assert_allclose(found[:, :, column][smooth], difference[smooth], rtol=0.02, atol=2e-2)
        assert smooth.mean() > 0.5


def test_an_output_held_at_its_limit_does_not_move():
    net = FeedForward(
        [np.eye(2)], [np.zeros(2)], {"output_softening": np.ones(2), "output_limit": np.array([1.0, 9.0])}
    )
    found = gradients(net, [[2.0, 2.0]])[0]
    assert found[0].tolist() == [0, 0] and found[1].tolist() == pytest.approx([0, np.cosh(2.0)])


def test_a_receptor_counts_by_all_its_colours_and_outputs():
    weights = np.zeros((2, 6))
    weights[:, 0], weights[0, 1], weights[1, 5] = (3, 4), -2, 1  # two receptors of three colours
    net = FeedForward([weights], [np.zeros(2)])
    stored = np.zeros((40, 6), np.uint8)
    np.testing.assert_allclose(saliency(net, stored, 2), [FULL * (5 + 2), FULL])


def test_vectors_that_do_not_fit_are_refused():
    net = network(0)
    for stored, receptors in ((np.zeros((0, 6), np.uint8), 2), (np.zeros((2, 5), np.uint8), 2), (np.zeros((2, 6)), 4)):
        with pytest.raises(UserError, match="receptors"):
            saliency(net, stored, receptors)
