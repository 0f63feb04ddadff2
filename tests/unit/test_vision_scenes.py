"""Scenes from which vision DNNs learn, on the seated body: labels, what is in view, shards."""

import numpy as np
import pytest
import yaml

from anthro import cli, registry
from anthro.errors import UserError
from anthro.eyes import synthesize
from anthro.eyes.measure import angle_between
from anthro.eyes.vision import RED, WHITE, Vision, gaze_command, seen_from
from anthro.eyes.witness import Witness
from anthro.files import read_shard, write_json
from anthro.motor.network import FeedForward
from anthro.render.raytrace import intersect
from anthro.streams import stream

SEED = 7
RECEPTORS = 3600


@pytest.fixture(scope="module")
def limbs(limb_keys):
    plans = {name: limb_keys(name) for name in registry.SEATED}
    return {name: {key: value for key, value in plan.items() if key != "name"} for name, plan in plans.items()}


@pytest.fixture(scope="module")
def witness(load_body, limbs):
    return Witness(load_body("nakada2018"), limbs, "log_polar", SEED)


@pytest.fixture
def spec(request, limbs):
    """The merged spec of a data set."""

    def of(dataset, **changes):
        path = request.config.rootpath / "config" / "data" / f"{dataset}.yaml"
        told = {"name": dataset, "limbs": limbs, "pairs": 3, "seed": SEED}
        return yaml.safe_load(path.read_text()) | told | changes

    return of


def still(outputs):
    """A network that always answers zero."""
    return FeedForward([np.zeros((outputs, 3 * RECEPTORS))], [np.zeros(outputs)])


def drawn(source):
    while (labels := source.draw()) is None:
        pass
    return labels


def test_a_turn_by_its_label_foveates(witness, spec):
    source = synthesize.Foveation(witness, spec("eyes_foveation"), stream(SEED, "test"))
    for _ in range(5):
        labels = drawn(source)
        centre = witness.in_head(witness.ball.centre)
        for eye, looks, told in zip(witness.eyes.eyes, witness.eyes.angles, labels, strict=True):
            turned = gaze_command(eye, looks, told)
            assert np.abs(seen_from(eye, turned, centre)).max() < 1e-9
        assert np.abs(witness.eyes.aim(witness.data, witness.ball.centre) - [
            gaze_command(*each) for each in zip(witness.eyes.eyes, witness.eyes.angles, labels, strict=True)
        ]).max() < 1e-9  # fmt: skip


def test_receptors_on_the_ball_are_those_whose_rays_meet_it_first(witness, spec):
    source = synthesize.Foveation(witness, spec("eyes_foveation"), stream(SEED, "test", 1))
    for _ in range(5):
        drawn(source)
        parts = witness.eyes.scene.place(witness.data).parts
        hits = intersect(parts, *witness.eyes.rays(witness.data))
        wanted = (hits.part == len(parts) - 1).reshape(2, -1).sum(axis=1)
        assert witness.on_ball().tolist() == wanted.tolist()
        assert wanted.min() >= 3


def test_a_ball_of_either_colour_lies_in_the_same_scene(witness, spec):
    drawn(synthesize.Foveation(witness, spec("eyes_foveation"), stream(SEED, "test", 5)))
    looks = {}
    for colour in (WHITE, RED):
        witness.show(colour)
        looks[colour] = witness.look().reshape(-1, 3)
    hits = intersect(witness.eyes.scene.parts, *witness.eyes.rays(witness.data))
    differs = (looks[WHITE] != looks[RED]).any(axis=1)
    assert differs.any() and np.array_equal(differs, hits.part == len(witness.eyes.scene.parts) - 1)


def test_a_ball_behind_the_head_is_not_seen(witness):
    witness.pose(0.0, stream(SEED, "test", 2))
    witness.ball.place(witness.in_world(np.array([-1.0, 0.0, 0.0])))
    assert witness.on_ball().tolist() == [0, 0]


def test_a_limbs_label_leads_from_effector_to_ball(witness, spec):
    vision = Vision([still(2), still(2)])
    source = synthesize.LimbVision(witness, spec("left_leg_vision"), stream(SEED, "test", 3), vision)
    for _ in range(3):
        labels = drawn(source)
        assert witness.ball.colour == RED
        rotation, _ = witness.eyes.head(witness.data)
        effector = witness.data.site_xpos[source.limb.site]
        for eye, looks, told in zip(witness.eyes.eyes, witness.eyes.angles, labels, strict=True):
            there = effector + rotation @ eye.rotation(looks) @ told
            np.testing.assert_allclose(there, witness.ball.centre, atol=1e-9)


def test_eyes_that_err_are_turned_by_their_networks(witness, spec):
    answer = FeedForward([np.zeros((2, 3 * RECEPTORS))], [np.array([0.1, 0.0])])
    source = synthesize.LimbVision(witness, spec("right_arm_vision"), stream(SEED, "t", 4), Vision([answer, answer]))
    drawn(source)
    before = witness.eyes.angles
    source._foveate()
    for eye, then, now in zip(witness.eyes.eyes, before, witness.eyes.angles, strict=True):
        np.testing.assert_allclose(now, eye.within(gaze_command(eye, then, np.array([0.1, 0.0]))), atol=1e-6)


def test_a_shard_is_made_again_to_the_byte_and_needs_eyes_that_foveate(tmp_path, body_folder, spec, capsys):
    write_json(tmp_path / "spec.json", spec("right_arm_vision"))
    for side in registry.SIDES:
        still(2).save(tmp_path / f"{side}.h5")
    told = ["--spec", str(tmp_path / "spec.json"), "--body", str(body_folder("nakada2018")), "--shard", "2"]
    nets = ["--foveation", *(str(tmp_path / f"{side}.h5") for side in registry.SIDES)]
    for name in ("a.h5", "b.h5"):
        assert cli.run(synthesize.main, [*told, *nets, "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    columns, attrs = read_shard(tmp_path / "a.h5")
    assert columns["left"].shape == (3, 3 * RECEPTORS) and columns["left"].dtype == np.uint8
    assert columns["right_offset"].shape == (3, 3) and attrs["scenes_drawn"] >= 3
    capsys.readouterr()
    assert cli.run(synthesize.main, [*told, "--out", str(tmp_path / "c.h5")]) == 2
    assert "foveate" in capsys.readouterr().err and not (tmp_path / "c.h5").exists()


def test_scenes_that_never_show_the_ball_are_told(witness, monkeypatch):
    monkeypatch.setattr(synthesize, "TRIES", 4)
    with pytest.raises(UserError, match="not seen in any of 4"):
        synthesize.synthesize(lambda: None, witness, "direction", 2)


def test_angle_between_directions():
    told, true = np.array([[0.0, 0.0], [0.3, 0.2]]), np.array([[0.0, 0.1], [0.3, 0.2]])
    np.testing.assert_allclose(angle_between(told, true), [0.1, 0.0], atol=1e-9)
