"""Operators around an emulator's network: round trips, invariance, normalisation, derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.neuroanimator import frames
from anthro.neuroanimator.operators import Chain, Frame, Inverse, Normalise, StateChange, ToLocal, ToWorld
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.segments import Segments

WIDTHS = {"fixed": 6, "planar": 6, "heading": 13, "body": 78}
KINDS = st.sampled_from(sorted(WIDTHS))
SEEDS = st.integers(0, 10**6)


def states_of(kind, seed, count=3):
    """Random frames' states with unit quaternions, and the frame."""
    generator, width = np.random.default_rng(seed), WIDTHS[kind]
    plain = Frame(kind, plain_rest(kind))
    return plain, plain.settle(generator.normal(size=(count, width))), generator


def plain_rest(kind):
    rest = np.zeros(WIDTHS[kind])
    if kind == "heading":
        rest[3] = 1.0
    if kind == "body":
        rest[18:42:4] = 1.0
    return rest


def moved(kind, states, seed):
    """The same states somewhere else: turned as the frame allows, and shifted."""
    generator = np.random.default_rng(seed)
    if kind == "fixed":
        return states
    out, shift = states.copy(), generator.normal(size=3)
    if kind == "planar":
        angle = generator.uniform(-3, 3)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        out[:, :2], out[:, 3:5] = states[:, :2] @ turn.T + shift[:2], states[:, 3:5] @ turn.T
        out[:, 2] += angle
        return out
    quaternion = generator.normal(size=4)
    if kind == "heading":
        quaternion[1:3] = 0.0
    quaternion /= np.linalg.norm(quaternion)
    turn = np.empty((3, 3))
    frames.rotation(quaternion, turn)
    count = states.shape[1] // 13
    for i in range(len(states)):
        for j in range(count):
            k = 3 * count + 4 * j
            frames.product(quaternion, states[i, k : k + 4], 1.0, out[i, k : k + 4])
            out[i, 3 * j : 3 * j + 3] = turn @ states[i, 3 * j : 3 * j + 3] + shift
            for first in (7 * count, 10 * count)[: 1 if kind == "heading" else 2]:
                out[i, first + 3 * j : first + 3 * j + 3] = turn @ states[i, first + 3 * j : first + 3 * j + 3]
    return out


@given(KINDS, SEEDS)
def test_operators_undo_themselves(kind, seed):
    frame, states, generator = states_of(kind, seed)
    inputs = np.concatenate([states, generator.normal(size=(3, 4))], axis=1)
    local = Chain(ToLocal(frame), Normalise(generator.normal(size=inputs.shape[1]), np.full(inputs.shape[1], 2.5)))
    assert np.allclose(local.invert(local.apply(inputs, states), states), inputs, atol=1e-9)
    changes = generator.normal(size=states.shape)
    chain = Chain(ToWorld(frame), StateChange(frame))
    world = ToWorld(frame)
    assert np.allclose(world.invert(world.apply(changes, states), states), changes, atol=1e-9)
    after = frame.settle(states + 0.1 * changes)
    assert np.allclose(chain.apply(chain.invert(after, states), states), after, atol=1e-9)
    back = Inverse(chain)
    assert np.allclose(back.apply(after, states), chain.invert(after, states))


@given(KINDS, SEEDS)
def test_local_states_and_changes_do_not_know_where_they_are(kind, seed):
    frame, states, generator = states_of(kind, seed)
    elsewhere = moved(kind, states, seed + 1)
    assert np.allclose(frame.local(states), frame.local(elsewhere), atol=1e-9)
    changes = 0.1 * generator.normal(size=states.shape)
    chain = Chain(ToWorld(frame), StateChange(frame))
    there = moved(kind, chain.apply(changes, states), seed + 1)
    assert np.allclose(chain.apply(changes, elsewhere), there, atol=1e-9)


@given(KINDS, SEEDS)
def test_derivatives_are_those_of_differences(kind, seed):
    frame, states, generator = states_of(kind, seed, 1)
    state, width, code = states[0], WIDTHS[kind], frame.kind
    change, weights, step = generator.normal(size=width), generator.normal(size=width), 1e-6
    steps = step * np.eye(width)

    def localised(values):
        out = np.empty(width)
        frames.localise(code, values, frame.rest, out)
        return weights @ out

    def turned(values, moves):
        out = np.empty(width)
        frames.turn_out(code, values, moves, out)
        return weights @ out

    def settled(values):
        out = values.copy()
        frames.settle(code, out)
        return weights @ out

    def slopes(function, at):
        return np.array([(function(at + e) - function(at - e)) / (2 * step) for e in steps])

    if kind == "heading" and np.hypot(state[3], state[6]) < 0.05:
        return  # upside down there is no heading
    found = np.zeros(width)
    frames.localise_back(code, state, weights, found)
    assert np.allclose(found, slopes(localised, state), rtol=1e-4, atol=1e-5)
    by_state, by_change = np.zeros((2, width))
    frames.turn_out_back(code, state, change, weights, by_state, by_change)
    assert np.allclose(by_state, slopes(lambda values: turned(values, change), state), rtol=1e-4, atol=1e-5)
    assert np.allclose(by_change, slopes(lambda values: turned(state, values), change), rtol=1e-4, atol=1e-5)
    found = weights.copy()
    frames.settle_back(code, 1.3 * state, found)
    assert np.allclose(found, slopes(settled, 1.3 * state), rtol=1e-4, atol=1e-5)


def test_groups_share_a_mean_and_a_deviation():
    values = np.array([[1.0, 3.0, 10.0], [3.0, 5.0, 14.0]])  # groups of two and of one
    operator = Normalise.fit(values, [2, 1])
    assert operator.mean.tolist() == [3.0, 3.0, 12.0]
    assert operator.scale == pytest.approx([np.sqrt(2.0), np.sqrt(2.0), 2.0])
    assert np.allclose(operator.apply(values), [[-np.sqrt(2), 0, -1], [0, np.sqrt(2), 1]])
    assert Normalise.fit(np.full((4, 1), 0.5), [1]).scale.tolist() == [1.0]
    with pytest.raises(ValueError, match=r"groups of \[2\] variables for 3 columns"):
        Normalise.fit(values, [2])


def test_a_lander_at_rest_has_no_local_state():
    plant = plant_of("lander")
    frame = Frame(plant.frame, plant.rest)
    there = moved("heading", plant.rest[None], 5)
    assert np.allclose(frame.local(there), 0.0, atol=1e-12)


def test_segments_of_a_dolphin_undo_themselves_and_turn_with_it():
    plant, generator = plant_of("dolphin"), np.random.default_rng(2)
    segments = Segments(plant)
    states = np.array([plant.step(plant.start(generator), generator.uniform(size=6), steps=60) for _ in range(5)])
    split, local = segments.split(states)
    assert split.shape == (5, 78) and local.shape == (5, 258)
    assert np.allclose(segments.assemble(split, local), states, atol=1e-12)
    still, none = segments.split(plant.rest[None])
    assert np.allclose(none, 0) and np.allclose(still[0, 18:42].reshape(6, 4), [1, 0, 0, 0])
    quaternion = generator.normal(size=4)
    turn = np.empty((3, 3))
    frames.rotation(quaternion / np.linalg.norm(quaternion), turn)
    turned = states.reshape(5, 46, 3) @ turn.T
    turned[:, :23] += [1.0, 2.0, 3.0]
    again, same = segments.split(turned.reshape(5, 138))
    frame = Frame("body", segments.rest)
    assert np.allclose(local, same, atol=1e-9) and np.allclose(frame.local(split), frame.local(again), atol=1e-9)
    inputs = [segments.local_inputs(*pair, 5) for pair in ((split, local), (again, same))]
    assert inputs[0].shape == (5, 72) and np.allclose(*inputs, atol=1e-9)
