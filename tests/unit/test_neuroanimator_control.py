"""Controllers: sizes, costs and slopes, descent with momentum by hand, searches that stop, command lines."""

import dataclasses

import numpy as np
import pytest
from test_neuroanimator_emulator import random_emulator

from anthro import registry
from anthro.errors import UserError
from anthro.neuroanimator import accuracy, search, timing
from anthro.neuroanimator.control import Problem, descend
from anthro.neuroanimator.emulator import Diverged
from anthro.neuroanimator.film import between
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.rows import PAPER
from anthro.neuroanimator.search import METHODS, spend
from anthro.neuroanimator.synthesize import main as synthesize_main
from anthro.neuroanimator.tasks import LENGTH, SUPER_STEP, TASKS, task_of
from anthro.scorecard import judge

VARIABLES = {"pendulum": 60, "truck": 40, "lander": 80, "dolphin": 60}  # Sec. 6
ITERATIONS = {"pendulum": 20, "truck": 15, "lander": 15, "dolphin": 20}


def problem_of(name):
    task = task_of(name)
    return Problem(task, random_emulator(task.plant)[0])


def test_tasks_are_those_of_the_paper_and_of_the_registry():
    assert TASKS.keys() == registry.TASKS.keys()
    assert LENGTH * SUPER_STEP == 2000, "20 s of 10 ms"
    for name in TASKS:
        task, plant = task_of(name), plant_of(task_of(name).plant)
        assert task.plant == registry.TASKS[name]
        assert (task.variables, task.iterations) == (VARIABLES[name], ITERATIONS[name])
        assert task.first.shape == (task.knots, plant.n_control)
        assert np.allclose(task.expansion.sum(axis=1), 1.0) and task.expansion.shape == (LENGTH, task.knots)
        assert task.reached(np.tile(task.start, (LENGTH + 1, 1))) > 1.0, "the goal is not where it starts"
        if name != "dolphin":
            assert task.reached(np.tile(task.desired, (LENGTH + 1, 1))) == 0.0
    with pytest.raises(UserError, match="unknown task 'boat'; known: pendulum"):
        task_of("boat")


def test_held_and_joined_controls():
    held, joined = task_of("truck").expansion, task_of("dolphin").expansion
    assert (held @ np.arange(20.0)).tolist() == np.repeat(np.arange(20.0), 2).tolist()
    line = joined @ np.arange(10.0)
    assert line[:2].tolist() == [0.0, 0.0] and line[2:6].tolist() == pytest.approx([0.125, 0.375, 0.625, 0.875])
    assert (np.diff(line) >= 0).all() and line[-1] == 9.0


@pytest.mark.parametrize("name", sorted(VARIABLES))
def test_slopes_of_objectives_are_those_of_differences(name):
    problem, generator = problem_of(name), np.random.default_rng(2)
    shape = problem.task.first.shape
    controls = problem.clip(problem.task.first + 0.1 * generator.normal(size=shape))
    slope = problem.slope(controls, problem.emulate(controls))
    direction, step = generator.normal(size=shape), 1e-5
    costs = [problem.cost(c, problem.emulate(c)) for c in (controls + step * direction, controls - step * direction)]
    assert np.sum(slope * direction) == pytest.approx((costs[0] - costs[1]) / (2 * step), rel=1e-4, abs=1e-8)


class Bowl:
    """A problem whose objective is half the squared distance of controls from 1."""

    class task:  # noqa: N801
        name, first = "bowl", np.zeros((2, 1))
        reached = staticmethod(lambda states: 2 * abs(states - 1).max())

    clip = emulate = staticmethod(lambda controls: controls)
    cost = staticmethod(lambda controls, states: 0.5 * float(np.sum((states - 1) ** 2)))
    slope = staticmethod(lambda controls, states: states - 1)


def test_momentum_by_hand():
    """Equations 14 and 15: d = rate (1 - u) + momentum d, u = u + d."""
    found = descend(Bowl(), rate=0.5, momentum=0.5, iterations=3)
    assert [float(u[0, 0]) for u in found.controls] == [0.0, 0.5, 1.0, 1.25]
    assert found.costs == [1.0, 0.25, 0.0, 0.0625] and found.reached == 1 and found.best == 2
    plain = descend(Bowl(), rate=0.5, momentum=0.0, iterations=2)
    assert [float(u[0, 0]) for u in plain.controls] == [0.0, 0.5, 0.75]


def test_an_emulation_that_diverges_names_task_and_iteration():
    problem = problem_of("truck")
    start = problem.task.start.copy()
    start[3] = 1e4
    problem.task = dataclasses.replace(problem.task, start=start)
    with pytest.raises(UserError, match="truck, iteration 0: truck: the rollout diverges at super-step 0: variable 3"):
        descend(problem, 0.1, 0.5, 2)


@pytest.mark.parametrize("method", sorted(METHODS))
def test_searches_count_and_stop(method):
    problem = problem_of("truck")
    told = spend(METHODS[method], problem, problem.task.first, 45, 3)
    assert told["evaluations"] == 45 and not told["reached"]
    assert 0 < told["iterations"] <= 45 and np.isfinite(told["best"]) and told["seconds"] > 0
    assert told | {"seconds": 0} == spend(METHODS[method], problem, problem.task.first, 45, 3) | {"seconds": 0}
    easy = dataclasses.replace(problem.task, shares={"done": lambda states: 0.5})
    problem.task = easy
    assert spend(METHODS[method], problem, easy.first, 45, 3)["evaluations"] == 1


def test_rows_of_searches_compare_with_backpropagation():
    runs = {
        "backpropagation": [
            {"reached": True, "reached_on_plant": True, "evaluations": 5, "iterations": 4, "seconds": 0.5}
        ],
        "cma_es": [{"reached": False, "evaluations": 1000, "iterations": 50, "seconds": 200.0}],
    }
    rows = {row["metric"]: judge(row) for row in search.rows_of("truck", runs, 1000)}
    assert rows["evaluations, cma-es over backpropagation"]["value"] == 200.0
    ratio = rows["time of an evaluation, cma-es over backpropagation"]
    assert ratio["value"] == pytest.approx(2.0) and ratio["status"] == "miss" and ratio["paper"] == PAPER


def test_error_measures_by_hand():
    error = np.array([[[0.0, 0.0], [1.0, -3.0]], [[0.0, 0.0], [np.nan, np.nan]]])
    assert accuracy.curve(error).tolist() == [0.0, 2.0]
    states = np.array([[[0.0, 5.0], [2.0, 5.0]]])  # deviations of 1 and 0
    assert accuracy.relative(np.array([[[0.0, 0.0], [0.5, 9.0]]]), states, 1) == 0.5
    assert np.isnan(accuracy.relative(np.full((1, 2, 2), np.nan), states, 1))


def test_error_grows_by_its_thirds():
    assert accuracy.growth(np.array([0.0, 1.0, 1.0, 5.0, 5.0, 3.0, 3.0])) == 3.0
    assert accuracy.growth(np.array([0.0, 2.0])) == 1.0


def test_divergence_is_dated_and_cut():
    def rollout(state, inputs):
        states = np.zeros((len(inputs) + 1, 1))
        if state[0] > 0:
            raise Diverged("net", "x", states[:2])
        return states

    found, ends = accuracy.emulated(rollout, np.array([[[0.0]] * 4, [[1.0]] * 4]), np.zeros((2, 3, 1)))
    assert ends.tolist() == [4, 1]
    assert np.isfinite(found[..., 0]).tolist() == [[True] * 4, [True, True, False, False]]


@pytest.mark.parametrize(("name", "seen"), [("truck", 3), ("lander", 9), ("dolphin", 71)])
def test_local_error_knows_no_place_and_no_heading(name, seen):
    plant, generator = plant_of(name), np.random.default_rng(0)
    states = np.array([[plant.step(plant.start(generator), steps=50) for _ in range(3)] for _ in range(2)])
    states[..., -3:] += 0.1 * generator.normal(size=(2, 3, 3))  # a truck without steering goes straight
    moved = states.copy()
    if name == "dolphin":
        moved[..., :69] += np.tile([5.0, -3.0, 2.0], 23)
    else:
        moved[..., :2] += 5.0
    if name == "truck":
        moved[..., 2] += 0.7
        c, s = np.cos(0.7), np.sin(0.7)
        moved[..., 3:5] = states[..., 3:5] @ np.array([[c, s], [-s, c]])
    moved[1, 2] = np.nan
    error = accuracy.local_error(plant, moved, states)
    assert error.shape == (2, 3, seen)
    assert np.abs(error[0]).max() < 1e-6 and np.isnan(error[1, 2]).all()
    moved[0, 1, -1] += 0.3
    assert np.abs(accuracy.local_error(plant, moved, states)[0, 1]).max() > 0.01


@pytest.mark.parametrize("name", ["truck", "lander", "dolphin"])
def test_errors_of_single_super_steps_add_up_in_the_plant_itself(name):
    plant = plant_of(name)
    states, inputs = accuracy.motions(plant, 50, 3, 2, 7)
    slip = np.zeros(plant.n_state)
    slip[0] = 0.01

    def rollout(state, given):
        force, control = np.split(given[0], [plant.n_force])
        if name == "truck" and np.array_equal(state, states[1, 2]):
            raise Diverged("net", "x", state[None])
        return np.stack([state, plant.step(state, control, force, 50) + slip])

    gap = accuracy.strayed(plant, rollout, states, inputs, 50) - states
    if name == "dolphin":  # one mass is pushed, the springs bring it back
        assert gap[0, 1, 0] == pytest.approx(0.01) and np.abs(gap[0, 3, :69]).max() < 0.02
    else:
        assert np.allclose(gap[0, :, 0], [0.0, 0.01, 0.02, 0.03]) and np.abs(gap[0, :, 1:]).max() < 1e-9
    assert np.isfinite(gap[1]).all(axis=1).tolist() == [True, True, True, name != "truck"]


def test_rows_of_accuracy_count_divergence_twice_and_compare_strains():
    told = {"mean_error": 0.1, "motion": 2.0, "growth": 4.0, "local_mean_error": 0.01, "local_growth": 1.5}
    told |= {"plant_growth": 3.9, "plant_local_growth": 1.0}
    told |= {"diverged_end": 0, "diverged_1000": 3, "relative_100": 0.1}
    metrics = {
        "n50": told | {"strain_error_end": 0.05, "strain_error_1000": 1.0},
        "n50_regularised": told | {"strain_error_end": 0.06, "strain_error_1000": 0.01},
    }
    rows = [judge(row) for row in accuracy.rows_of("dolphin", metrics, 30, 6000, 1000)]
    status = {row["metric"]: row["status"] for row in rows}
    assert status["trials of 30 that diverged in 6000 steps"] == "pass"
    assert status["trials of 30 that diverged in 1000 super-steps"] == "miss"
    assert status["error of the last third over the first"] == "miss"
    assert status["error of the local state, last third over the first"] == "pass"
    assert status["strain error with over without regularisation after 6000 steps"] == "near"
    assert status["strain error with over without regularisation after 1000 super-steps"] == "pass"


def test_rows_of_timing_stand_beside_table_2():
    times = {"lander": {"simulation": 6.0, "n50": 0.1, "n50_batch": 0.2}}
    rows = {row["metric"]: judge(row) for row in timing.rows_of(times, 20000)}
    assert rows["n50: simulation over emulation"]["status"] == "pass"
    assert rows["n50 batch: simulation over emulation"]["status"] == "miss"
    assert rows["n50: time"]["target"] == 0.12


def test_motion_between_super_steps_lies_on_a_line():
    times, states = np.array([0.0, 0.5, 1.0]), np.array([[0.0], [1.0], [5.0]])
    assert [float(between(times, states, at)[0]) for at in (0.0, 0.25, 0.75, 1.0, 9.0)] == [0.0, 0.5, 3.0, 5.0, 5.0]


def test_missing_networks_and_bad_numbers_are_one_line(refusal, tmp_path):
    out = ["--run", tmp_path, "--out", tmp_path / "out"]
    assert "operators.h5: no such file" in refusal(synthesize_main, [*out, "--task", "truck"])
    assert "unknown task 'boat'" in refusal(synthesize_main, [*out, "--task", "boat"])
    assert "--seeds: at least 1" in refusal(search.main, [*out, "--task", "truck", "--seeds", "0"])
    assert "a multiple of 100" in refusal(timing.main, [*out, "--steps", "50"])
    line = refusal(accuracy.main, [*out, "--plant", "truck", "--super-steps", "50", "--length", "10"])
    assert "at least one trial of one super-step" in line
