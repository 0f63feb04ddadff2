"""The sensorimotor loop with tiny networks: what is true of the ball reaches the body through its eyes alone."""

from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
import yaml

from anthro import cli
from anthro.demos import bouncing, cannon, gaze, perception, shaken, sight_timing
from anthro.demos.sighted import Setting, opened
from anthro.errors import UserError
from anthro.eyes import scene
from anthro.eyes.eye import SIDES
from anthro.files import read_json, read_shard, write_json
from anthro.motor.network import FeedForward
from anthro.motor.senses import direction
from anthro.registry import REACHING
from anthro.world.cannon import Shot
from anthro.world.slopes import staircase
from anthro.world.stool import Shaking

ROOT = Path(__file__).resolve().parents[2]
WIDTH = 10800
ARM = "right_arm"


def tiny_vision(outputs, seed, scale):
    rng = np.random.default_rng(seed)
    matrices = [rng.normal(0.0, 1e-3, (4, WIDTH)), rng.normal(0.0, scale, (outputs, 4))]
    return FeedForward(matrices, [np.zeros(4), np.zeros(outputs)])


@pytest.fixture(scope="module", autouse=True)
def flesh_once():
    """The limbs' flesh is the same for all: it is made once."""
    with pytest.MonkeyPatch.context() as patch:
        known, make = [], scene.flesh

        def once(*arguments):
            known[:] = known or [make(*arguments)]
            return known[0]

        patch.setattr(scene, "flesh", once)
        yield


@pytest.fixture
def run(run_folder):
    """A run with tiny vision nets and the plan of its loop, whose limb vision is heeded wherever the target is."""
    plan = yaml.safe_load((ROOT / "config" / "loop.yaml").read_text())
    write_json(run_folder / "specs" / "loop.json", plan | {"foveated_deg": 180.0})
    roles = [("foveation", 2, 0.05), *((f"{limb}_vision", 3, 0.2) for limb in REACHING)]
    for prefix in ("", "uniform_"):
        for seed, (role, outputs, scale) in enumerate(roles):
            for number, side in enumerate(SIDES):
                path = run_folder / "nets" / f"{prefix}{role}_{side}" / "weights.h5"
                tiny_vision(outputs, 2 * seed + number, scale).save(path)
    return run_folder


def sighted(run, setting):
    return opened(Namespace(run=run, inputs=None, seed=7), setting)


def moved(one, how, *ways):
    """Postures after each of some runs from rest."""
    found = []
    for way in ways:
        one.restart(list(one.setting.leads))
        how(one, way)
        found.append(np.concatenate([one.simulator.qpos, one.eyes.angles.ravel(), one.cycle.activation]))
    return found


def same(first, second):
    """But for the rounding of the time, which goes on from trial to trial."""
    np.testing.assert_allclose(first, second, rtol=0, atol=1e-9)


def fly(one, place):
    """A ball that hangs in the air for a while and hits nothing."""
    one.run(0.25, lambda _: np.array(place))


def shot_past(one, start):
    """A ball that flies past the body, as a demo shoots and watches it."""
    cannon.shoot(one, Shot(ARM, np.array(start), np.array([-6.0, 1.5, 3.0]), np.zeros(3), 0.2))


@pytest.mark.parametrize("how", ["reach", "meet"])
def test_where_the_ball_truly_is_reaches_the_body_through_its_eyes_alone(run, how, monkeypatch):
    """With one and the same picture on the retinas, movements are the same wherever the ball is."""
    one = sighted(run, Setting({ARM: how}))
    ways = [(fly, ((0.6, -0.3, 1.0), (0.8, 0.5, 1.3))), (shot_past, ((2.5, 0.9, 1.5), (2.2, 0.8, 0.9)))]
    seen = [moved(one, act, *places) for act, places in ways]
    for first, second in seen:
        assert np.abs(first - second).max() > 1e-4, "the loop does not heed what it sees"
    one.restart([ARM])
    rotation, position = one.eyes.head(one.simulator.data)
    one.balls.position[0] = position + 0.6 * rotation @ direction(0.0, 0.0)
    one._shown.place(one.balls.position[0])
    picture = one.eyes.see(one.simulator.data)
    assert one.cycle.onlooker.look(one.simulator.data, 0.0, [ARM]).offsets
    monkeypatch.setattr(one.eyes, "see", lambda data: picture)
    for act, places in ways:
        same(*moved(one, act, *places))
    assert not np.array_equal(moved(one, fly, (0.6, -0.3, 1.0))[0], one._start[0])


def test_a_ball_that_is_not_seen_leads_nothing(run):
    """Behind the body, and not in play: the same movements."""
    one = sighted(run, Setting({ARM: "reach"}))
    behind, nowhere = moved(one, fly, (-2.0, 0.3, 1.0), (np.nan, np.nan, np.nan))
    same(behind, nowhere)
    assert one.cycle.goals == {} and not one.eyes.angles.any()


def test_trials_begin_alike_and_repeat(run):
    one = sighted(run, Setting({ARM: "meet"}))
    first, _, again = moved(one, shot_past, (2.5, 0.3, 1.2), (2.2, -0.3, 0.9), (2.5, 0.3, 1.2))
    same(first, again)


def test_rates_of_the_parts_are_their_own(run, monkeypatch):
    plan = read_json(run / "specs" / "loop.json") | {"sight_steps": 4, "control_steps": 2}
    write_json(run / "specs" / "loop.json", plan)
    one = sighted(run, Setting({ARM: "reach"}))
    counts = dict.fromkeys(("see", "activation", "step"), 0)

    def counted(inner, name):
        def call(*arguments):
            counts[name] += 1
            return inner(*arguments)

        return call

    for part, name in ((one.eyes, "see"), (one.cycle.system, "activation"), (one.simulator, "step")):
        monkeypatch.setattr(part, name, counted(getattr(part, name), name))
    one.restart([ARM])
    one.run(20 * one.simulator.step_seconds, lambda _: np.array([0.6, -0.3, 1.0]))
    assert counts == {"see": 5, "activation": 10, "step": 20}


def test_a_simulation_that_diverges_ends_its_trial_only(run):
    one = sighted(run, Setting(dict.fromkeys(REACHING, "meet"), movable=True))
    shot = cannon.shots(one, REACHING, 1, 7, "cannon")[0]

    def break_off(simulator):
        simulator.qvel[:] = np.nan

    one.restart([shot.limb])
    outcome = cannon.shoot(one, shot, break_off)
    assert not outcome.touched and "simulation" in outcome.failed
    one.restart([shot.limb])
    assert cannon.shoot(one, shot).failed == ""
    one.restart([shot.limb])
    with pytest.raises(UserError, match="diverges"):
        one.run(0.1, before=lambda simulator: simulator.qvel.__imul__(1e3))
    recorder = shaken.RootRecorder(one, REACHING)
    one.recorder = recorder
    assert shaken.shake(one, Shaking(0.05, 3.0), shot, recorder).failed == ""
    base = recorder.columns()["base"]
    assert base.shape == (len(recorder.rows), 7) and np.ptp(base[:, 2]) > 0.05 and not np.ptp(base[:, 0])


def test_the_head_rests_and_one_eye_is_shut_where_that_is_asked(run):
    whole, still, single = (
        sighted(run, Setting({ARM: "reach"}, **change)) for change in ({}, {"head": False}, {"one_eye": True})
    )
    for one in (whole, still, single):
        one.restart([ARM])
        one.run(0.3, lambda _: np.array([0.6, -0.3, 1.0]))
    turned = [np.arccos(one.eyes.head(one.simulator.data)[0][0, 0]) for one in (whole, still)]
    assert turned[0] != turned[1]
    assert np.isnan(single.cycle.percept.discrepancy[1]).all()


COLUMNS = {
    "ball": (1, 3),
    "eyes": (2, 2),
    "nerve": (2, WIDTH),
    "discrepancy": (2, 2),
    "trial": (),
    "head": (3,),
}


@pytest.mark.parametrize(
    ("demo", "options", "limbs", "bars"),
    [
        (perception, [], 1, 2),
        (perception, ["--no-head", "--one-eye"], 1, 0),
        (perception, ["--retina", "uniform"], 1, 0),
        (cannon, [], 4, 1),
        (bouncing, [], 1, 1),
        (shaken, [], 4, 1),
    ],
)
def test_a_demo_writes_what_the_interface_says(run, tmp_path, demo, options, limbs, bars, monkeypatch):
    monkeypatch.setattr(perception, "SECONDS", 0.6)
    out = tmp_path / "out"
    told = [f"--{key}={value}" for key, value in {"run": run, "seed": 7, "targets": 1, "out": out}.items()]
    assert cli.run(demo.main, [*told, *options]) == 0
    columns, attrs = read_shard(out / "rollout.h5")
    count = len(columns["time"])
    for name, shape in (COLUMNS | {"estimate": (limbs, 3), "effector": (limbs, 3)}).items():
        assert columns[name].shape == (count, *shape), name
    assert columns["nerve"].dtype == np.uint8 and columns["trial"].dtype == np.int16
    np.testing.assert_allclose(np.linalg.norm(columns["head"], axis=1), 1.0)
    assert attrs["ball_radius"] == 0.05 and attrs["ball_colour"] and attrs["retina"] in ("log_polar", "uniform")
    assert ("slopes" in attrs) == (demo is bouncing)
    rows = read_json(out / "rows.json")
    assert sum(row["target"] is not None for row in rows) == bars
    assert read_json(out / "run_card.json")["spec"]["targets"] == 1
    if demo is bouncing:
        assert len(yaml.safe_load(attrs["slopes"])) == len(staircase())


def test_gaze_and_timing_tell_their_numbers(run, tmp_path, monkeypatch):
    for module, name, value in (
        (gaze, "PURSUIT_SECONDS", 1.5),
        (gaze, "SHIFT_SECONDS", 0.2),
        (gaze, "LOOK_SECONDS", 0.2),
        (sight_timing, "SECONDS", 0.1),
        (sight_timing, "REPEATS", 2),
    ):
        monkeypatch.setattr(module, name, value)
    for demo in (gaze, sight_timing):
        out = tmp_path / demo.__name__
        told = [f"--run={run}", "--seed=7", f"--out={out}", *(["--targets=1"] if demo is gaze else [])]
        assert cli.run(demo.main, told) == 0
        assert all(row["value"] is None or np.isfinite(row["value"]) for row in read_json(out / "rows.json"))
    metrics = read_json(tmp_path / gaze.__name__ / "metrics.json")
    assert {f"{eye}_peak_{size}_deg_saccade" for eye in ("paper", "main_sequence") for size in (5, 15, 30)} <= set(
        metrics
    )


def test_what_is_missing_is_told_in_one_line(run, refusal):
    (run / "nets" / "foveation_left" / "weights.h5").unlink()
    assert "foveation_left" in refusal(perception.main, ["--run", run])
    assert "--targets" in refusal(cannon.main, ["--run", run, "--targets", "0"])
    (run / "specs" / "loop.json").unlink()
    tiny_vision(2, 0, 0.1).save(run / "nets" / "foveation_left" / "weights.h5")
    assert "loop.json" in refusal(cannon.main, ["--run", run])


def test_ways_of_looking_are_measured_as_they_are_told():
    errors = np.full((200, 2), 0.5)
    assert perception.time_to_foveate(errors) == np.inf
    errors[60:] = 0.01
    assert perception.time_to_foveate(errors) == pytest.approx(0.305)
    errors[70] = 0.5
    assert perception.time_to_foveate(errors) == pytest.approx(0.36)
    turn = np.deg2rad(np.array([0.0, 1.0, 3.0]))
    gazes = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)[:, None]
    np.testing.assert_allclose(np.rad2deg(gaze.speeds(gazes))[:, 0], [200.0, 400.0])
