"""Emulators: Table 1, the compiled pass against the plain one, batches, gradients through time, divergence, pairs."""

from pathlib import Path

import numpy as np
import pytest

from anthro import config, registry
from anthro.errors import UserError
from anthro.files import read_json, read_shard, write_json, write_shard
from anthro.learn.train import main as train_main
from anthro.learn.train import train
from anthro.motor.network import FeedForward
from anthro.neuroanimator import hierarchy
from anthro.neuroanimator.emulator import Diverged, Emulator, load_emulator
from anthro.neuroanimator.hierarchy import HierarchicalEmulator
from anthro.neuroanimator.operators import Frame
from anthro.neuroanimator.plants import PLANTS, plant_of
from anthro.neuroanimator.plants.plant import STEP, Group, RigidPlant
from anthro.neuroanimator.present import groups_of, present
from anthro.neuroanimator.present import main as present_main
from anthro.neuroanimator.sample import main as sample_main
from anthro.neuroanimator.sample import sample, transitions
from anthro.neuroanimator.segments import Segments

ROOT = Path(__file__).resolve().parents[2]
PAPER = config.load({"scale": "paper"}, ROOT)
SMOKE = config.load({"scale": "smoke"}, ROOT)
TABLE_1 = {  # state inputs, force inputs, control inputs, hidden units, state outputs, training examples
    "passive_pendulum": (6, 0, 0, 20, 6, 2400),
    "active_pendulum": (6, 0, 3, 20, 6, 3000),
    "forced_pendulum": (6, 3, 3, 20, 6, 3000),
    "lander": (13, 0, 4, 50, 13, 13500),
    "truck": (6, 0, 2, 40, 6, 5200),
    "dolphin_global": (78, 0, 6, 50, 78, 64000),
    "dolphin_local6": (72, 0, 6, 40, 36, 32000),
}


def random_net(n_in, hidden, n_out, seed=0, scale=0.1):
    generator = np.random.default_rng(seed)
    matrices = [generator.normal(size=(hidden, n_in)) / np.sqrt(n_in), scale * generator.normal(size=(n_out, hidden))]
    biases = [0.1 * generator.normal(size=hidden), -matrices[1].sum(axis=1) / 2]
    return FeedForward(matrices, biases, attrs={"activation": "sigmoid"})


def random_factors(n_in, n_out, seed=1):
    generator = np.random.default_rng(seed)
    return {
        "input_mean": 0.1 * generator.normal(size=n_in),
        "input_scale": generator.uniform(0.5, 2.0, n_in),
        "output_mean": 0.01 * generator.normal(size=n_out),
        "output_scale": generator.uniform(0.05, 0.2, n_out),
    }


def random_emulator(name, seed=0):
    plant = plant_of(name)
    rest = plant.rest if name != "dolphin" else Segments(plant).rest
    width = len(rest) + plant.n_force + plant.n_control
    factors = random_factors(width, len(rest), seed + 1)
    variables = tuple(f"variable {k}" for k in range(len(rest)))
    return Emulator(name, random_net(width, 12, len(rest), seed), Frame(plant.frame, rest), factors, variables), rest


def started(name, emulator, rest, count, seed=3):
    plant, generator = plant_of(name), np.random.default_rng(seed)
    states = np.array([plant.start(generator) for _ in range(count)])
    if name == "dolphin":
        states = Segments(plant).split(states)[0]
    return states, generator.normal(size=(10, emulator.n_input))


@pytest.mark.parametrize("row", sorted(TABLE_1))
def test_networks_are_those_of_table_1(row):
    for name, content in PAPER["emulators"].items():
        if not name.startswith(row):
            continue
        plant, spec = plant_of(content["plant"]), config.emulator_spec(PAPER, name)
        told, answered = groups_of(plant, content["part"])
        widths = [sum(group.size for group in part) for part in (told, answered)]
        state = widths[0] - plant.n_force - plant.n_control
        found = (state, plant.n_force, plant.n_control, *content["hidden"], widths[1], content["examples"])
        assert found == TABLE_1[row]
        assert (content["inputs"], content["outputs"]) == (
            [group.name for group in told],
            [f"{group.name}_change" for group in answered],
        )
        assert spec["samples"] - max(1, round(spec["samples"] / 10)) == content["examples"], "all of them train"
        assert config.plant_spec(PAPER, content["plant"], content["super_step"])["examples"] >= spec["rows"]


def test_the_registry_lists_the_emulators():
    assert registry.EMULATORS.keys() == PAPER["emulators"].keys()
    for name, net in registry.EMULATORS.items():
        content = PAPER["emulators"][name]
        assert (net.plant, net.part, net.super_step) == (content["plant"], content["part"], content["super_step"])
        assert content["name"] == name
    assert registry.PLANTS.keys() == PAPER["plants"].keys()
    assert sum(net.part.startswith("local") for net in registry.EMULATORS.values()) == 6


@pytest.mark.parametrize("name", ["forced_pendulum", "truck", "lander", "dolphin"])
def test_one_step_of_the_compiled_rollout_is_operators_around_the_network(name):
    emulator, rest = random_emulator(name)
    states, inputs = started(name, emulator, rest, 1)
    both = np.concatenate([states, inputs[:1]], axis=1)
    answered = emulator.network.predict(emulator.inputs.apply(both, states)).astype(float)
    wanted = emulator.outputs.apply(answered, states)
    assert np.allclose(emulator.rollout(states[0], inputs)[1], wanted[0], atol=1e-6)


@pytest.mark.parametrize("name", ["forced_pendulum", "truck", "lander", "dolphin"])
def test_a_batch_goes_as_its_rollouts(name):
    emulator, rest = random_emulator(name)
    states, inputs = started(name, emulator, rest, 3)
    alone = np.array([emulator.rollout(state, inputs) for state in states])
    together = states
    for t, given in enumerate(inputs):
        together = emulator.step(together, np.tile(given, (3, 1)))
        assert np.allclose(together, alone[:, t + 1], atol=1e-9)


@pytest.mark.parametrize("name", ["forced_pendulum", "truck", "lander", "dolphin"])
def test_the_gradient_through_time_is_that_of_differences(name):
    emulator, rest = random_emulator(name, seed=5)
    states, inputs = started(name, emulator, rest, 1)
    generator = np.random.default_rng(9)
    weights, direction = generator.normal(size=(11, len(rest))), generator.normal(size=inputs.shape)

    def objective(values):
        return float(np.sum(weights * emulator.rollout(states[0], values) ** 2)) / 2

    found = emulator.rollout(states[0], inputs)
    slopes = emulator.slopes(found, inputs, weights * found)
    step = 1e-6
    difference = (objective(inputs + step * direction) - objective(inputs - step * direction)) / (2 * step)
    assert np.sum(slopes * direction) == pytest.approx(difference, rel=1e-5, abs=1e-6)


def test_the_hierarchy_compiled_goes_as_in_a_batch_and_holds_together_when_regularised():
    plant, segments = plant_of("dolphin"), Segments(plant_of("dolphin"))
    whole, _ = random_emulator("dolphin")
    parts = []
    for j, count in enumerate(segments.counts):
        n_in, n_out = 6 * count + 42, 6 * count
        factors = random_factors(n_in, n_out, j) | {
            "output_scale": np.full(n_out, 0.01),
            "output_mean": np.zeros(n_out),
        }
        parts.append((random_net(n_in, 8, n_out, j), factors))
    dolphin, controls = HierarchicalEmulator(plant, whole, parts), np.random.default_rng(0).uniform(size=(5, 6))
    frames, local = dolphin.emulate(plant.rest, controls)
    together = tuple(np.repeat(part[:1], 2, axis=0) for part in (frames, local))
    for t, given in enumerate(controls):
        together = dolphin.step(*together, np.tile(given, (2, 1)))
        assert np.allclose(together[0][1], frames[t + 1]) and np.allclose(together[1][1], local[t + 1])
    free, held = (dolphin.rollout(plant.rest, controls, count) for count in (0, 5))

    def strain(states):
        points = states[-1, :69].reshape(23, 3)
        return np.abs(np.linalg.norm(points[plant.pairs[:, 1]] - points[plant.pairs[:, 0]], axis=1) / plant.lengths - 1)

    assert strain(held).mean() < 0.9 * strain(free).mean()


def test_regularisation_relaxes_springs_and_leaves_the_motion_alone():
    plant, generator = plant_of("dolphin"), np.random.default_rng(0)
    x, v = plant.points + 0.02 * generator.normal(size=(23, 3)), generator.normal(size=(23, 3))
    springs = plant.pairs, plant.owner, plant.lengths, hierarchy.SOFTER * plant.stiffness
    shortening, count = np.zeros(6), hierarchy.REGULARISATIONS

    def gaps(points):
        lengths = np.linalg.norm(points[plant.pairs[:, 1]] - points[plant.pairs[:, 0]], axis=1)
        return np.abs(lengths / plant.lengths - 1).mean()

    places, speeds = x.copy(), v.copy()
    hierarchy._regularise(places, speeds, shortening, plant.mass, *springs, count)
    assert gaps(places) < 0.9 * gaps(x) and speeds.std() < v.std()
    assert np.allclose(plant.mass @ places, plant.mass @ x) and np.allclose(plant.mass @ speeds, plant.mass @ v)
    still = np.zeros((23, 3))
    hierarchy._regularise(x, still, shortening, plant.mass, *springs, count)
    assert not still.any(), "springs leave no velocity behind"


def test_a_diverging_rollout_names_super_step_and_variable():
    emulator, rest = random_emulator("truck")
    with pytest.raises(Diverged, match=r"truck: the rollout diverges at super-step 0: variable 3") as caught:
        emulator.rollout(np.array([0, 0, 0, 1e3, 0, 0.0]), np.zeros((3, 2)))
    assert caught.value.states.shape == (1, 6)
    bad = np.zeros((3, 2))
    bad[1] = np.nan
    with pytest.raises(Diverged, match="at super-step 2"):
        emulator.rollout(np.zeros(6), bad)


def test_an_emulator_has_sigmoids_and_fitting_operators():
    frame = Frame("fixed", np.zeros(6))
    net = random_net(6, 4, 6)
    relu = FeedForward(net.matrices, net.biases)
    with pytest.raises(ValueError, match="one hidden layer of sigmoids"):
        Emulator("odd", relu, frame, random_factors(6, 6), ())
    with pytest.raises(ValueError, match="do not fit together"):
        Emulator("odd", net, frame, random_factors(7, 6), ())
    with pytest.raises(ValueError, match="activation 'tanh' is not one of relu, sigmoid"):
        FeedForward(net.matrices, net.biases, attrs={"activation": "tanh"})


def test_a_sigmoid_network_predicts_by_hand(tmp_path):
    net = FeedForward([[[1.0, -1.0]], [[2.0]]], [[0.0], [1.0]], attrs={"activation": "sigmoid"})
    wanted = 1 + 2 / (1 + np.exp(-0.5))
    assert net.predict([1.0, 0.5])[0] == pytest.approx(wanted) == net.predict([[1.0, 0.5]])[0, 0]
    net.save(tmp_path / "weights.h5")
    assert FeedForward.load(tmp_path / "weights.h5").predict([1.0, 0.5])[0] == pytest.approx(wanted)


def test_examples_lie_one_to_five_super_steps_apart(monkeypatch):
    plant, taken = plant_of("active_pendulum"), []
    monkeypatch.setattr(plant, "step", lambda s, u, f, n: taken.append(n) or np.array(s))
    drawn = transitions(plant, 50, 1e9, np.random.default_rng(0))
    for _ in range(400):
        next(drawn)
    lags, since = [], None
    for n in taken:  # a recorded super-step of 50 begins each lag; what follows it belongs to it
        since = n if since is None else since + n
        if n < 50:
            lags.append(since)
            since = None
    assert min(taken) >= 1 and max(taken) == 50
    assert all(lag > 50 for lag in lags)


def test_sampling_repeats_itself_and_is_shuffled():
    spec = {"plant": "truck", "super_step": 50, "seconds": 20.0, "examples": 30, "seed": 7}
    first, again = sample(spec), sample(spec)
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert not np.array_equal(first["state"], sample(spec | {"seed": 8})["state"])
    plant = plant_of("truck")
    assert np.allclose(plant.step(first["state"], first["control"], steps=50), first["next_state"])
    with pytest.raises(UserError, match="the spec has no 'seed'"):
        sample({key: value for key, value in spec.items() if key != "seed"})


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A truck's emulator of a small run, made by the command lines of its stages."""
    run = tmp_path_factory.mktemp("run")
    folder, spec = run / "neuroanimator", config.emulator_spec(SMOKE, "truck_n50") | {"epochs": 2, "searches": 30}
    write_json(run / "data.json", config.plant_spec(SMOKE, "truck", 50) | {"seconds": 20})  # few, so many short ones
    write_json(run / "net.json", spec)
    sample_main(["--spec", f"{run / 'data.json'}", "--out", f"{run / 'truck.h5'}"])
    pairs = folder / "pairs" / "truck_n50"
    present_main(["--spec", f"{run / 'net.json'}", "--examples", f"{run / 'truck.h5'}", "--out", f"{pairs}"])
    train(run / "net.json", [pairs / "pairs.h5"], folder / "nets" / "truck_n50")
    return run


def test_a_trained_emulator_is_close_to_its_plant(trained):
    plant, card = plant_of("truck"), read_json(trained / "neuroanimator" / "nets" / "truck_n50" / "run_card.json")
    assert card["pairs"]["training"] == 260 and card["best"]["validation_mse"] < 0.2
    emulator = load_emulator(trained, "truck_n50", plant)
    state, inputs = np.array([0, 0, 0.3, 2.0, 0.6, 0.0]), np.tile([0.5, 0.05], (2, 1))
    moved = plant.step(state, inputs[0], steps=100) - state
    assert np.abs(emulator.rollout(state, inputs)[-1] - state - moved).max() < 0.3 * np.abs(moved).max()


def test_pairs_that_come_unnormalised_are_refused(trained, refusal, tmp_path):
    columns, _ = read_shard(trained / "neuroanimator" / "pairs" / "truck_n50" / "pairs.h5")
    arguments = ["--spec", trained / "net.json", "--shards", tmp_path / "odd.h5", "--out", tmp_path / "net"]
    write_shard(tmp_path / "odd.h5", columns | {"velocity": columns["velocity"] + 0.5})
    assert "truck_n50: velocity is not normalised (mean 0." in refusal(train_main, arguments)
    write_shard(tmp_path / "odd.h5", columns | {"heading_change": 3 * columns["heading_change"]})
    assert "truck_n50: heading_change is not normalised" in refusal(train_main, arguments)


def test_examples_of_another_plant_are_refused(trained, refusal, tmp_path):
    write_json(tmp_path / "net.json", config.emulator_spec(SMOKE, "lander_n50"))
    line = refusal(
        present_main, ["--spec", tmp_path / "net.json", "--examples", trained / "truck.h5", "--out", tmp_path]
    )
    assert "of truck at 50 steps, not of lander_n50" in line
    examples, _ = read_shard(trained / "truck.h5", ("state", "control", "force", "next_state"))
    spec = config.emulator_spec(SMOKE, "truck_n50")
    with pytest.raises(UserError, match="truck_n50: 999 examples wanted, there are"):
        present(spec | {"rows": 999}, examples)
    with pytest.raises(UserError, match="truck_n50: inputs and outputs are place, heading"):
        present(spec | {"inputs": ["place"]}, examples)


@pytest.mark.parametrize("optimiser", ["momentum", "conjugate_gradient"])
def test_other_optimisers_learn_resume_and_repeat(tmp_path, optimiser):
    generator = np.random.default_rng(0)
    x = generator.normal(size=(300, 2))
    write_shard(tmp_path / "a.h5", {"x": x, "y": np.tanh(x[:, :1] - x[:, 1:])})
    keys = {"name": "a", "inputs": ["x"], "outputs": ["y"], "hidden": [6], "batch_size": 30, "epochs": 6, "seed": 1}
    keys |= {"learning_rate": 0.1, "activation": "sigmoid", "start": "uniform", "optimiser": optimiser, "searches": 5}
    write_json(tmp_path / "spec.json", keys)
    train(tmp_path / "spec.json", [tmp_path / "a.h5"], tmp_path / "one")
    train(tmp_path / "spec.json", [tmp_path / "a.h5"], tmp_path / "two")
    assert (tmp_path / "one" / "weights.h5").read_bytes() == (tmp_path / "two" / "weights.h5").read_bytes()
    card = read_json(tmp_path / "one" / "run_card.json")
    assert card["best"]["validation_mse"] < 0.1
    assert FeedForward.load(tmp_path / "one" / "weights.h5").activation == "sigmoid"


class Cart(RigidPlant):
    """The plant of the README's ten lines."""

    name = "cart"
    state = (Group("place", ("x",), "m"), Group("velocity", ("velocity x",), "m/s"))
    control = (Group("push", ("push",), "N"),)
    low, high = np.array([-1.0]), np.array([1.0])

    def __init__(self):
        slide = '<joint name="x" type="slide" axis="1 0 0" damping="0.2"/><geom size="0.1" mass="1"/>'
        super().__init__(
            f'<mujoco><option timestep="{STEP}"/><worldbody><body>{slide}</body></worldbody>'
            '<actuator><motor joint="x"/></actuator></mujoco>'
        )

    def start(self, generator):
        return generator.uniform(-1, 1, 2)


def test_a_plant_of_ten_lines_is_sampled_presented_and_learned(monkeypatch, tmp_path):
    cart = Cart()
    monkeypatch.setitem(PLANTS, "cart", lambda: cart)
    keys = {"plant": "cart", "super_step": 50, "seconds": 10.0, "seed": 1, "examples": 200}
    net = {"name": "cart_n50", "part": "whole", "rows": 200, "inputs": ["place", "velocity", "push"], "hidden": [6]}
    net |= {"outputs": ["place_change", "velocity_change"], "normalised": True, "activation": "sigmoid"}
    net |= {"optimiser": "conjugate_gradient", "searches": 50, "epochs": 2, "learning_rate": 1.0, "batch_size": 200}
    write_json(tmp_path / "net.json", keys | net)
    pairs, factors = present(keys | net, sample(keys))
    folder = tmp_path / "neuroanimator"
    write_shard(folder / "pairs" / "cart_n50" / "pairs.h5", pairs)
    write_shard(folder / "pairs" / "cart_n50" / "operators.h5", factors)
    train(tmp_path / "net.json", [folder / "pairs" / "cart_n50" / "pairs.h5"], folder / "nets" / "cart_n50")
    emulator = load_emulator(tmp_path, "cart_n50", cart)
    moved = emulator.rollout(np.zeros(2), np.full((4, 1), 0.5))[-1]
    assert np.allclose(moved, cart.step(np.zeros(2), [0.5], steps=200), atol=0.15)
