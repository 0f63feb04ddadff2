"""Plants of the NeuroAnimator: energy, momentum, rest, batches, and what they refuse."""

import numpy as np
import pytest

from anthro import registry
from anthro.errors import UserError
from anthro.neuroanimator.plants import PLANTS, lander, plant_of, truck
from anthro.neuroanimator.plants import dolphin_shape as shape
from anthro.neuroanimator.plants import pendulum as hung
from anthro.neuroanimator.plants.dolphin import Dolphin
from anthro.neuroanimator.plants.pendulum import Pendulum
from anthro.neuroanimator.sample import checked
from anthro.neuroanimator.tasks import RAISED, one_go

EQUILIBRIA = {"passive_pendulum", "active_pendulum", "forced_pendulum", "truck", "dolphin"}


def test_the_registry_lists_the_plants():
    assert PLANTS.keys() == registry.PLANTS.keys()
    with pytest.raises(UserError, match="unknown plant 'boat'; known: passive_pendulum"):
        plant_of("boat")


@pytest.mark.parametrize("name", sorted(EQUILIBRIA))
def test_at_rest_nothing_moves(name):
    plant = plant_of(name)
    assert np.allclose(plant.step(plant.rest, plant.low * 0, steps=200), plant.rest, atol=1e-9)


def test_the_lander_hovers_when_its_rocket_bears_its_weight():
    plant = plant_of("lander")
    assert np.allclose(plant.step(plant.rest, [0.5, 0, 0, 0], steps=500), plant.rest, atol=1e-9)
    fallen = plant.step(plant.rest, np.zeros(4), steps=100)
    assert fallen[9] == pytest.approx(-lander.GRAVITY, rel=1e-6)


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_a_batch_is_its_rows_and_a_row_its_own_steps(name):
    plant, generator = plant_of(name), np.random.default_rng(1)
    states = np.array([plant.start(generator) for _ in range(4)])
    controls = np.array([plant.typical(generator).at(0.0, state) for state in states])
    steps = np.array([1, 5, 20, 50])
    together = plant.step(states, controls, steps=steps)
    alone = [plant.step(s, u, steps=n) for s, u, n in zip(states, controls, steps, strict=True)]
    assert np.array_equal(together, alone)
    halves = plant.step(plant.step(states, controls, steps=10), controls, steps=15)
    assert np.allclose(halves, plant.step(states, controls, steps=25), atol=1e-9)


def test_a_free_pendulum_keeps_its_energy_and_a_rubbing_one_loses_it():
    rubbing, start = plant_of("passive_pendulum"), np.array([1.0, 0.2, -0.1, 0, 0, 0])
    swing = rubbing.energy(start) - rubbing.energy(rubbing.rest)
    drifts = []
    for finer in (1, 10):
        free = Pendulum(motors=False, friction=0.0)
        free.model.opt.timestep /= finer
        states = [start]
        for _ in range(50):
            states.append(free.step(states[-1], steps=10 * finer))
        drifts.append(np.abs([free.energy(state) - free.energy(start) for state in states]).max())
    assert drifts[0] < 0.2 * swing and drifts[1] < 0.15 * drifts[0], "the error is of first order in the step"
    losing = [rubbing.energy(rubbing.step(start, steps=n)) for n in (0, 50, 200, 800)]
    assert losing == sorted(losing, reverse=True) and losing[-1] < losing[0] - 0.5 * swing


def test_a_pendulum_is_moved_by_motors_and_by_forces():
    forced = plant_of("forced_pendulum")
    assert forced.step(forced.rest, [1.0, 0, 0], steps=10)[0] > 0
    assert forced.step(forced.rest, np.zeros(3), [2.0, 2.0, 2.0], steps=10)[0] > 0
    ends = hung.points_of(np.array([np.pi / 2, 0, 0, 0, 0, 0]))
    assert np.allclose(ends[-1], [3 * hung.LENGTH, 0])


def test_the_motors_cannot_raise_the_arm_in_one_go():
    """Without turning back a motor does at most torque times angle of work; raising the arm takes more."""
    plant = plant_of("active_pendulum")
    target = np.array([RAISED, 0, 0, 0, 0, 0])
    lift = plant.energy(target) - plant.energy(plant.rest)
    assert one_go() == pytest.approx(hung.TORQUES[0] * RAISED / lift) and one_go() < 0.3
    signs = np.stack(np.meshgrid(*[[-1, 1]] * 3), axis=-1).reshape(-1, 3)
    reached = -3 * hung.LENGTH
    for sign in signs:
        state = plant.rest
        for _ in range(200):
            state = plant.step(state, sign * plant.high, steps=10)
            reached = max(reached, hung.points_of(state)[-1, 1])
    assert reached < hung.points_of(target)[-1, 1] - 1.0


def test_a_truck_rolls_turns_and_skids():
    plant = plant_of("truck")
    ahead = plant.step(plant.rest, [1.0, 0.0], steps=200)
    assert ahead[0] > 1.0 and abs(ahead[1]) < 1e-9
    left = plant.step(plant.rest, [1.0, 0.3], steps=200)
    right = plant.step(plant.rest, [1.0, -0.3], steps=200)
    assert left[1] > 0.05 and np.allclose(left * [1, -1, -1, 1, -1, -1], right, atol=1e-9)
    sideways = plant.step([0, 0, 0, 0, 5.0, 0], [0, 0], steps=10)
    assert sideways[4] == pytest.approx(5.0 - 2 * truck.GRIP / truck.MASS * 0.1, rel=0.02)
    coasting = plant.step([0, 0, 0, 3.0, 0, 0], [0, 0], steps=1000)
    assert 0 < coasting[3] < 3.0


def test_the_dolphin_is_that_of_the_paper():
    plant = plant_of("dolphin")
    assert len(plant.points) == 23 and len(plant.pairs) == 91 and len(set(map(tuple, plant.pairs))) == 91
    assert [len(part) for part in plant.segments] == [5, 8, 8, 8, 8, 6]
    assert (
        plant.n_state == 138 and plant.n_control == 6 and np.bincount(plant.owner[plant.owner >= 0]).tolist() == [2] * 6
    )
    assert plant.mass.sum() == pytest.approx(shape.DENSITY_MASS)
    edges = {tuple(sorted(edge)) for face in plant.faces for edge in zip(face, np.roll(face, 1), strict=True)}
    assert len(plant.faces) == 2 * 23 - 4 and len(edges) == 3 * 23 - 6, "a closed skin"


def test_without_water_the_dolphin_keeps_its_momentum_and_loses_energy():
    dry, generator = Dolphin(water=0.0), np.random.default_rng(3)
    state = dry.rest + 0.01 * generator.normal(size=138)
    state[69:] += 0.1 * generator.normal(size=69)
    momentum = dry.mass @ state[69:].reshape(23, 3)
    losing = [dry.energy(state)]
    for _ in range(20):
        state = dry.step(state, steps=5)
        losing.append(dry.energy(state))
    assert np.allclose(dry.mass @ state[69:].reshape(23, 3), momentum, atol=1e-9)
    assert losing == sorted(losing, reverse=True)


def test_water_brakes_the_dolphin_and_its_muscles_bend_it():
    plant = plant_of("dolphin")
    gliding = plant.rest.copy()
    gliding[69::3] = 1.0
    assert 0.2 < plant.step(gliding, np.zeros(6), steps=100)[69:].reshape(23, 3)[:, 0].mean() < 0.99
    up = plant.step(plant.rest, [1, 1, 1, 0, 0, 0], steps=100)[:69].reshape(23, 3)
    ends, middle = up[[0, 21, 22], 2].mean(), up[9:13, 2].mean()
    assert ends > middle + 0.05, "dorsal muscles lift nose and flukes"


@pytest.mark.parametrize("name", ["lander", "dolphin", "truck"])
def test_dynamics_do_not_know_where_they_are(name):
    """A plant turned about the vertical and moved goes the same way, turned and moved."""
    plant, generator = plant_of(name), np.random.default_rng(4)
    state = plant.start(generator)
    control = plant.typical(generator).at(0.0, state)
    turn = _turned(name, 0.7, [1.0, -2.0])
    assert np.allclose(
        plant.step(turn(state), control, steps=50), turn(plant.step(state, control, steps=50)), atol=1e-8
    )


def _turned(name, angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    flat = np.array([[c, -s], [s, c]])

    def turn(state):
        out = np.array(state)
        if name == "dolphin":
            vectors = out.reshape(46, 3)
            vectors[:, :2] = vectors[:, :2] @ flat.T
            vectors[:23, :2] += shift
        elif name == "truck":
            out[:2], out[3:5], out[2] = flat @ out[:2] + shift, flat @ out[3:5], out[2] + angle
        else:
            out[:2], out[7:9] = flat @ out[:2] + shift, flat @ out[7:9]
            half, side = np.cos(angle / 2), np.sin(angle / 2)
            w, x, y, z = state[3:7]
            out[3:7] = half * w - side * z, half * x - side * y, half * y + side * x, half * z + side * w
        return out

    return turn


def test_odd_inputs_are_refused():
    plant = plant_of("truck")
    with pytest.raises(ValueError, match="a state of 5 variables, not 6"):
        plant.step(np.zeros(5))
    with pytest.raises(ValueError, match="3 inputs where 2 are wanted"):
        plant.step(np.zeros(6), np.zeros(3))
    with pytest.raises(UserError, match="truck: the simulation diverges at step 150: heading"):
        checked(plant, np.array([0, 0, np.nan, 0, 0, 0]), 1.5)
