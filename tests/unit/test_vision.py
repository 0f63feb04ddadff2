"""Vision DNNs: frames of their answers, receptive fields, training on bytes behind a fixed first layer."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.eyes.eye import Eye
from anthro.eyes.layout import layout
from anthro.eyes.vision import gaze_command, seen_from
from anthro.files import write_json, write_shard
from anthro.learn.data import ByteMoments, find_pairs, survey
from anthro.learn.retinotopic import receptive_fields, spread_evenly
from anthro.learn.rows import Activations, Rows
from anthro.learn.spec import read_spec
from anthro.learn.train import Training, train
from anthro.motor.network import FeedForward

RECEPTORS = 3600
SPEC = {
    "name": "tiny",
    "inputs": ["left"],
    "outputs": ["left_direction"],
    "hidden": [60, 12],
    "learning_rate": 3e-3,
    "batch_size": 16,
    "epochs": 4,
    "start": "retinotopic",
    "receptive_fields": {"retina": "log_polar", "side": "left", "cones": ["red", "blue"], "neighbours": [8]},
    "fixed_epochs": 2,
    "softening": {"left_direction": 0.1},
    "seed": 3,
}
angle = st.floats(-0.7, 0.7)


@given(
    angle, angle, st.floats(0.2, 4.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.sampled_from(["left", "right"])
)
def test_what_an_eye_is_told_turns_it_to_its_target(theta, phi, ahead, aside, up, side):
    eye, looks = Eye(side), np.array([theta, phi])
    point = eye.centre + [ahead, aside * ahead, up * ahead]
    told = seen_from(eye, looks, point)
    np.testing.assert_allclose(gaze_command(eye, looks, told), eye.angles_to(point), atol=1e-9)


def test_at_level_gaze_a_turn_to_the_left_is_added():
    eye = Eye("left")
    np.testing.assert_allclose(gaze_command(eye, np.array([0.2, 0.0]), np.array([0.1, 0.0])), [0.3, 0.0], atol=1e-12)
    ahead = eye.centre + [1.0, 0.0, 0.0]
    np.testing.assert_allclose(seen_from(eye, np.array([0.2, 0.0]), ahead), [-0.2, 0.0], atol=1e-12)
    np.testing.assert_allclose(seen_from(eye, np.array([0.0, 0.3]), ahead), [0.0, -0.3], atol=1e-12)


def test_receptive_fields_lie_evenly_and_see_their_neighbours_only():
    directions = layout("log_polar", "left", 7).directions
    centres = spread_evenly(directions, 300, np.random.default_rng(0))
    assert len(set(centres)) == 300
    again = spread_evenly(directions, 2 * len(directions), np.random.default_rng(0))
    assert (np.bincount(again) == 2).all()
    fields = receptive_fields(directions, centres, 8)
    np.testing.assert_allclose(np.linalg.norm(fields, axis=1), 1.0)
    assert (fields.argmax(axis=1) == centres).all() and (fields >= 0).all()
    seen = (fields > 0).sum(axis=1)
    assert seen.min() > 8 and seen.max() < 300
    near = np.sort(np.linalg.norm(directions - directions[centres[0]], axis=1))[8]
    away = np.linalg.norm(directions - directions[centres[0]], axis=1)
    other = np.flatnonzero(fields[0])[1]
    ratio = fields[0, other] / fields[0, centres[0]]
    assert ratio == pytest.approx(np.exp(-0.5 * (away[other] / near) ** 2))


def test_gaps_between_receptive_fields_are_smaller_than_among_random_ones():
    directions = layout("uniform", "left", 7).directions
    rng = np.random.default_rng(1)
    even = directions[spread_evenly(directions, 200, rng)]
    random = directions[rng.choice(len(directions), 200, replace=False)]
    gap = [np.linalg.norm(directions[:, None] - some, axis=2).min(axis=1).max() for some in (even, random)]
    assert gap[0] < 0.7 * gap[1]


def test_bytes_are_taken_from_what_they_mostly_are():
    rows = np.full((5, 3), 90, np.uint8)
    rows[0] = [100, 90, 60]
    moments = ByteMoments()
    moments.add(rows[:0])
    moments.add(rows)
    assert moments.mean.tolist() == [90, 90, 90]
    np.testing.assert_allclose(moments.scale, np.sqrt((10**2 + 30**2) / 15))


def nerves(path, n=120, seed=0):
    """A shard in which a red patch about a receptor says where it is."""
    rng = np.random.default_rng(seed)
    directions = layout("log_polar", "left", 3).directions
    seen = np.full((n, RECEPTORS, 3), 60, np.uint8)
    place = directions[rng.integers(RECEPTORS, size=n)]
    for row, centre in zip(seen, place, strict=True):
        row[directions @ centre > np.cos(0.2), 0] = 250
    where = np.stack([np.arctan2(place[:, 1], place[:, 0]), np.arcsin(place[:, 2])], axis=1)
    write_shard(path, {"left": seen.reshape(n, -1), "left_direction": where.astype(np.float32)})
    return str(path)


@pytest.fixture
def job(tmp_path):
    shards = [nerves(tmp_path / "shard.h5")]

    def make(name="a", **changes):
        write_json(tmp_path / f"{name}.json", SPEC | changes)
        return {"spec_path": tmp_path / f"{name}.json", "shards": shards, "out": tmp_path / name}

    return make


def start(job):
    spec = read_spec(job["spec_path"])[0]
    pairs = find_pairs(spec, job["shards"])
    return Training(spec, Rows(pairs, survey(pairs)[0], job["out"]))


def test_units_start_alike_and_listen_to_one_kind_of_cone(job):
    training = start(job())
    weights = training.network.layers[0].weight.detach().numpy().reshape(60, RECEPTORS, 3)
    assert (weights[:30, :, 1:] == 0).all() and (weights[30:, :, :2] == 0).all()
    inputs, _ = next(training.rows.batches(np.arange(108), 108))
    with torch.no_grad():
        size = training.network.layers[0](inputs)[:, :30].square().mean(dim=0).sqrt()
    assert size.max() < 1.0001 and (size > 0.9999).float().mean() > 0.8, "all but those that hardly ever see anything"


def test_rows_of_bytes_are_normalised_as_online(job):
    training = start(job())
    network = training.network.export(training.rows.factors)
    stored = np.concatenate([np.full((1, 3 * RECEPTORS), 60), np.full((1, 3 * RECEPTORS), 61)]).astype(np.uint8)
    factors = training.rows.factors
    assert (stored[0] == factors["input_mean"]).mean() > 0.5, "background is zero, which is passed over"
    inputs = torch.from_numpy((stored - factors["input_mean"]) / factors["input_scale"])
    with torch.no_grad():
        wanted = training.network(inputs).numpy() * factors["output_scale"] + factors["output_mean"]
    np.testing.assert_allclose(network.predict(stored), 0.1 * np.sinh(wanted), rtol=1e-3, atol=1e-5)


def test_activations_are_the_first_layer(job):
    training = start(job())
    kept = Activations(training.rows, training.network.layers[0])
    for (x, y), (h, z) in zip(training.rows.held_out(), kept.held_out(), strict=True):
        with torch.no_grad():
            assert torch.equal(y, z)
            np.testing.assert_allclose(torch.relu(training.network.layers[0](x)), h, rtol=1e-3, atol=1e-3)
            np.testing.assert_allclose(training.network(x), training.network(h, 1), atol=1e-2)


def test_first_layer_moves_when_it_may(job):
    training = start(job())
    before = training.network.layers[0].weight.clone()
    for fixed in (True, True, False, False):
        training.run_epoch()
        assert torch.equal(training.network.layers[0].weight, before) == fixed


@pytest.mark.parametrize("after", [1, 2, 3])
def test_a_training_behind_a_fixed_layer_resumes_to_the_same_bytes(job, monkeypatch, after):
    monkeypatch.setattr("anthro.learn.train.SPARING", 0)
    whole, broken = job(), job() | {"out": job()["out"].with_name("b"), "state_folder": job()["out"].with_name("c")}
    train(**whole)
    run, done = Training.run_epoch, []

    def run_and_die(self):
        if len(done) == after:
            done.append(0)
            raise KeyboardInterrupt
        done.append(0)
        run(self)

    monkeypatch.setattr(Training, "run_epoch", run_and_die)
    with pytest.raises(KeyboardInterrupt):
        train(**broken)
    train(**broken)
    assert (whole["out"] / "weights.h5").read_bytes() == (broken["out"] / "weights.h5").read_bytes()


def test_bad_wishes_are_refused(job):
    with pytest.raises(UserError, match="not softened"):
        train(**job(softening={"left": 0.1}))
    with pytest.raises(UserError, match="receptive_fields"):
        train(**job(receptive_fields={"retina": "log_polar"}))
    content = {name: value for name, value in SPEC.items() if name != "receptive_fields"}
    given = job()
    write_json(given["spec_path"], content)
    with pytest.raises(UserError, match="retinotopic"):
        train(**given)


def test_trained_on_bytes_a_network_finds_the_patch(job):
    given = job(epochs=30, fixed_epochs=30)
    network = train(**given)
    assert isinstance(network, FeedForward) and network.attrs["unexplained_variance"] < 0.5
