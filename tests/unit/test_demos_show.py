"""Demos that show what the controllers do: their geometry by hand, and their command lines on untrained networks."""

import json
from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.demos import draw, hold, neck_on_off, on_off, push, reclining, supine, timing
from anthro.demos.leaning import ROOT, Leaning
from anthro.demos.session import Session, advance
from anthro.demos.staying import carried, staying
from anthro.errors import UserError
from anthro.figures.nakada2018 import timing as timing_figure
from anthro.files import read_json, read_shard
from anthro.motor.system import MotorSystem
from anthro.registry import SEATED
from anthro.render.rollout import read_rollout
from anthro.world.strokes import Stroke
from anthro.world.trajectory import Plane, Trajectory

DEMOS = (draw, hold, neck_on_off, on_off, push, reclining, supine)
LINE = Stroke(np.array([[-0.02, 0.0], [0.02, 0.0]]))


@pytest.fixture
def seated(run_folder):
    """Session of the seated body, its root movable."""
    return Session.open(run_folder, "nakada2018", movable=True)


@pytest.fixture(scope="module")
def low(load_body):
    """A seated body that can lean, 30 cm lower than it was built."""
    leaning = Leaning(load_body("nakada2018").movable())
    leaning.rise(-0.3)
    return leaning


@pytest.fixture
def short(monkeypatch):
    """Demos of fractions of a second."""
    for module, name in (
        (draw, "APPROACH_SECONDS"),
        (draw, "REST_SECONDS"),
        (on_off, "ON_SECONDS"),
        (on_off, "OFF_SECONDS"),
        (neck_on_off, "ON_SECONDS"),
        (neck_on_off, "OFF_SECONDS"),
        (neck_on_off, "LIFT_SECONDS"),
        (neck_on_off, "MOVE_SECONDS"),
        (supine, "SETTLE_SECONDS"),
        (hold, "APPROACH_SECONDS"),
        (hold, "HOLD_SECONDS"),
        (push, "WATCH_SECONDS"),
    ):
        monkeypatch.setattr(module, name, 0.1)
    shapes = {name: replace(shape, strokes=lambda: [LINE]) for name, shape in draw.SHAPES.items()}
    monkeypatch.setattr(draw, "SHAPES", shapes)
    monkeypatch.setattr(reclining, "SHAPES", shapes)


def run(module, run_folder, out, *more):
    """A demo's exit code, with its files under ``<run>/demos/<out>``."""
    folder = run_folder / "demos" / out
    code = module.main([str(a) for a in ["--run", run_folder, "--out", folder, "--json", *more]])
    return code, folder


# -- a body that leans --------------------------------------------------------------------------------


def test_a_body_on_its_back_faces_up_and_gravity_pulls_along_its_back(seated):
    leaning, body = Leaning(seated.body), seated.body
    upright = seated.simulator()
    leaning.put(np.pi / 2)
    lying = seated.simulator()
    for name in body.effectors:
        x, y, z = upright.effector_position(name) - upright.data.xpos[ROOT]
        np.testing.assert_allclose(lying.effector_position(name) - lying.data.xpos[ROOT], [-z, y, x], atol=1e-9)
        np.testing.assert_allclose(
            leaning.carry(upright.effector_position(name), np.pi / 2), lying.effector_position(name)
        )
    elbow = body.model.nv - body.dof_count + body.dof_names.index("elbow_flexion_r")
    assert upright.data.qfrc_bias[elbow] != pytest.approx(lying.data.qfrc_bias[elbow], abs=0.1)
    # with gravity turned instead of the body, the joints feel the same
    leaning.put(0.0)
    body.model.opt.gravity[:] = [-9.81, 0.0, 0.0]
    turned = seated.simulator()
    np.testing.assert_allclose(turned.data.qfrc_bias, lying.data.qfrc_bias, atol=1e-3)


def test_the_simulator_follows_a_moved_base_and_keeps_nothing_stale(seated):
    leaning, simulator = Leaning(seated.body), seated.simulator()
    silent = np.zeros(seated.body.muscle_count)
    for angle in (0.1, 0.2, 0.3):
        leaning.put(angle)
        simulator.step(silent)
    fresh = seated.simulator()
    fresh.reset(simulator.qpos.copy(), simulator.qvel.copy())
    np.testing.assert_allclose(simulator.data.site_xpos, fresh.data.site_xpos, atol=1e-12)
    np.testing.assert_allclose(simulator.data.qfrc_bias, fresh.data.qfrc_bias, atol=1e-9)
    np.testing.assert_allclose(simulator.strain, fresh.strain, atol=1e-12)


def test_only_the_sessions_own_body_leans(seated, load_body):
    Leaning(seated.body).put(1.0)
    np.testing.assert_allclose(load_body("nakada2018").model.body_quat[ROOT], [1, 0, 0, 0])


def test_a_free_root_does_not_lean(whole):
    with pytest.raises(UserError, match="free"):
        Leaning(whole)


@given(angle=st.floats(-1.5, 1.5), point=st.tuples(*[st.floats(-2, 2)] * 3))
def test_what_is_carried_is_raised_again(low, angle, point):
    there = low.carry(np.array(point), angle)
    np.testing.assert_allclose(low.raised(there, angle), point, atol=1e-12)
    many = low.raised(np.stack([there, there]), np.array([angle, 0.0]))
    np.testing.assert_allclose(many[0], point, atol=1e-12)
    assert low.pose(np.zeros(4)).shape == (4, 7)


def test_other_limbs_targets_are_where_they_rest_and_lean_along(seated):
    simulator = seated.simulator()
    kept = staying(seated, simulator, but=("left_arm",))
    assert set(kept) == set(SEATED) - {"left_arm"}
    assert all(seated.limb(name).distance(simulator.data, target) < 1e-12 for name, target in kept.items())
    leaning = Leaning(seated.body)
    leaning.put(0.6)
    simulator.refresh()
    there = carried(seated, kept, leaning, 0.6)
    assert all(seated.limb(name).distance(simulator.data, target) < 1e-9 for name, target in there.items())


# -- a limb that is off ---------------------------------------------------------------------------------


def test_a_limb_that_is_off_is_limp_and_the_others_are_not(seated):
    class Tense:
        def __init__(self, limb):
            self.limb = limb

        def activation(self, simulator, target):
            return np.full(self.limb.size, 0.3)

    arm, leg = seated.limb("right_arm"), seated.limb("right_leg")
    system = MotorSystem(seated.body, {"right_arm": Tense(arm), "right_leg": Tense(leg)})
    seen = []

    class Told:
        def take(self, activation, targets, controller_on=True):
            seen.append((activation.copy(), controller_on, set(targets)))

    targets = {"right_arm": np.zeros(3), "right_leg": np.zeros(3)}
    distance = advance(seated.simulator(), system, targets, 0.005, Told(), off=("right_arm",))
    activation, on, told = seen[0]
    assert not activation[arm.muscles].any() and (activation[leg.muscles] == 0.3).all()
    assert not on and told == set(targets) and np.isfinite(distance["right_arm"]).all()


# -- drawing -----------------------------------------------------------------------------------------------


def test_every_point_of_the_drawings_is_well_inside_the_reach_space(seated):
    for shape in draw.SHAPES.values():
        limb, trajectory = seated.lead(shape.limb, shape.effector), shape.trajectory()
        teacher = seated.teacher(shape.limb)
        for at in np.linspace(0.0, trajectory.duration, 25):
            pose = teacher.kinematics.solve(trajectory.position(at))
            margin = np.minimum(pose.q - limb.low, limb.high - pose.q) / (2 * limb.half_range)
            assert pose.reached and margin.min() > 0.0499 and teacher.lacks(pose) < limb.plan.lack


def test_a_finger_that_is_where_it_should_be_draws_the_path(seated):
    """Ink is measured in the plane, which leans with the body."""
    shape = replace(draw.SHAPES["writing"], strokes=lambda: [LINE])
    lesson = draw.Lesson(seated, shape, lambda time: 0.3 * np.asarray(time))
    steps = len(lesson.time)
    pen = Leaning(seated.body).carry(lesson.trajectory.position(lesson.time - draw.APPROACH_SECONDS), 0.3 * lesson.time)
    both = np.stack([pen, pen], axis=1)
    columns = lesson._columns({"time": lesson.time, "effector": both, "target": both.copy()})
    np.testing.assert_allclose(columns["ink"], columns["reference"], atol=1e-12)
    np.testing.assert_allclose(columns["base"][0, 3:], [1, 0, 0, 0], atol=1e-12)
    assert np.isnan(columns["target"][:, 1]).all()
    metrics = lesson._metrics(columns, np.full(steps, np.deg2rad(2.0)))
    assert metrics["rms_error_m"] < 5e-5 and metrics["rms_tracking_m"] < 1e-9
    assert metrics["mean_gaze_error_deg"] == pytest.approx(2.0)
    columns["ink"] = columns["ink"] + [0.0, 0.004, 0.003]
    metrics = lesson._metrics(columns, np.zeros(steps))
    assert metrics["rms_error_m"] == pytest.approx(0.005, rel=1e-3)


def test_a_pen_pauses_before_a_stroke():
    plane, strokes = Plane([0, 0, 0], [0, -1, 0], [0, 0, 1]), [LINE, LINE]
    paused, hasty = (Trajectory(strokes, plane, 0.1, pause=pause) for pause in (0.4, 0.0))
    assert paused.duration == pytest.approx(hasty.duration + 0.4)
    first = (hasty.duration - 0.4) / 2  # each of the two equal strokes; the move between them takes 0.4 s at 0.1 m/s
    waiting = first + 0.4 + np.linspace(0.01, 0.39, 5)
    np.testing.assert_allclose(paused.reference(waiting), np.tile([-0.02, 0, 0], (5, 1)), atol=1e-12)
    assert not paused.pen_down(waiting).any() and paused.pen_down(first + 0.81)
    with pytest.raises(UserError, match="pause"):
        Trajectory(strokes, plane, 0.1, pause=-1.0)


@pytest.mark.parametrize("shape", draw.SHAPES)
def test_draw(run_folder, short, capsys, shape):
    code, folder = run(draw, run_folder, "write", "--shape", shape)
    metrics = json.loads(capsys.readouterr().out)
    assert code == 0 and metrics.keys() >= {"rms_error_m", "coverage_rms_m", "rms_tracking_m", "mean_gaze_error_deg"}
    rollout = read_rollout(run_folder, "write")
    assert rollout.limbs == (draw.SHAPES[shape].limb, "neck_seated") and rollout.props == ("stool",)
    count = len(rollout.time)
    columns, _ = read_shard(folder / "rollout.h5")
    assert columns["ink"].shape == columns["pen"].shape == columns["reference"].shape == (count, 3)
    np.testing.assert_array_equal(columns["pen"], columns["effector"][:, 0])
    assert not columns["pen_down"][0] and columns["pen_down"].any()
    bars = {entry["metric"]: entry["target"] for entry in read_json(folder / "rows.json")}
    assert bars["rms_error_m"] == 0.01


def test_reclining(run_folder, short, monkeypatch, capsys):
    monkeypatch.setattr(reclining, "PERIOD", 0.4)
    code, folder = run(reclining, run_folder, "write_reclining")
    rollout = read_rollout(run_folder, "write_reclining")
    assert code == 0 and rollout.props == ("chair",)
    np.testing.assert_allclose(rollout.base[0, 3:], [1, 0, 0, 0], atol=1e-12)
    half = np.deg2rad(35.0) / 2
    np.testing.assert_allclose(rollout.base[40, 3:], [np.cos(half), 0, -np.sin(half), 0], atol=1e-9)
    assert "Fig. 27" in read_json(folder / "rows.json")[0]["item"]


# -- on and off --------------------------------------------------------------------------------------------


def test_on_off(run_folder, short, capsys):
    code, _ = run(on_off, run_folder, "on_off")
    metrics = json.loads(capsys.readouterr().out)
    rollout = read_rollout(run_folder, "on_off")
    assert code == 0 and rollout.limbs == ("left_arm",) and len(rollout.switches()) == 2
    muscles = Session.open(run_folder, "nakada2018").limb("left_arm").muscles
    off = ~rollout.controller_on
    assert not rollout.activation[off][:, muscles].any() and rollout.activation[off].any()
    assert metrics["fall_m"] == pytest.approx(metrics["hand_height_on_m"] - metrics["hand_height_off_m"])


def test_neck_on_off(run_folder, short, capsys):
    code, folder = run(neck_on_off, run_folder, "neck_on_off")
    metrics = json.loads(capsys.readouterr().out)
    columns, _ = read_shard(folder / "rollout.h5")
    assert code == 0 and columns["direction"].shape == (len(columns["time"]), 2)
    np.testing.assert_allclose(columns["direction"][0], 0.0, atol=1e-6)
    assert metrics.keys() >= {"droop_deg", "error_lifted_again_deg", *(f"error_{m}_deg" for m in neck_on_off.MOVES)}
    assert len(read_rollout(run_folder, "neck_on_off").switches()) == 2


# -- supine, hold, push -------------------------------------------------------------------------------------


def test_a_supine_body_lies_on_the_ground_and_its_targets_are_over_it(seated):
    bed = supine.Bed(seated)
    simulator = bed.simulator()
    contacts = seated.body.contacts
    torso = [i for i, site in enumerate(contacts.sites) if supine._is_welded(seated.body.model, site)]
    lowest = (simulator.data.site_xpos[contacts.sites, 2] - contacts.radius)[torso].min()
    assert lowest == pytest.approx(0.0, abs=1e-9)
    chest = simulator.data.site_xpos[contacts.sites[contacts.names.index("sternum_front")], 2]
    targets = bed.targets("right_arm", 4, seed=7)
    assert all(target[2] > chest + supine.CLEARANCE and abs(target[1]) < supine.SPREAD for target in targets)
    np.testing.assert_array_equal(targets, bed.targets("right_arm", 4, seed=7))
    teacher = seated.teacher("right_arm")
    assert all(teacher.kinematics.solve(target).reached for target in targets)


def test_supine(run_folder, short, capsys):
    code, _ = run(supine, run_folder, "supine", "--targets", 1)
    metrics = json.loads(capsys.readouterr().out)
    for arm in supine.ARMS:
        for inputs in ("paper", "proprioceptive"):
            assert 0.0 <= metrics[f"{arm}_{inputs}_success_rate"] <= 1.0
    rollout = read_rollout(run_folder, "supine")
    assert code == 0 and rollout.props == ("floor",) and rollout.limbs == supine.ARMS
    np.testing.assert_allclose(np.abs(rollout.base[:, 3:]), [[np.sqrt(0.5), 0, np.sqrt(0.5), 0]] * len(rollout.time))


def test_drift_by_hand():
    assert hold.drift(np.array([[0, 0, 1.0], [0, 0.003, 1.004], [0, 0, 1.001]])) == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("displacement", "seconds"),
    [
        ([0.0, 0.009, 0.0], 0.0),  # never away
        ([0.02, 0.02, 0.005, 0.0], 0.010),
        ([0.0, 0.02, 0.0, 0.02, 0.0], 0.020),  # the last time counts
        ([0.02, 0.0, 0.02], np.inf),
    ],
)
def test_recovery_time_by_hand(displacement, seconds):
    assert push.recovery_time(np.array(displacement)) == pytest.approx(seconds)


@pytest.mark.parametrize("module", [hold, push])
def test_hold_and_push(run_folder, short, capsys, module):
    code, folder = run(module, run_folder, "it", "--targets", 2)
    metrics = json.loads(capsys.readouterr().out)
    assert code == 0 and metrics["targets"] == 2 and metrics["limb"] == "right_arm"
    assert any(entry["target"] is not None for entry in read_json(folder / "rows.json"))
    assert read_rollout(run_folder, "it").body.name == "nakada2018"


# -- bad input ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("module", [*DEMOS, timing])
def test_a_missing_run_and_missing_weights_are_named(run_folder, refusal, module):
    assert "norun" in refusal(module.main, ["--run", run_folder / "norun"])
    for weights in (run_folder / "nets").glob("*_voluntary_*/weights.h5"):
        weights.unlink()
    assert "weights.h5: no such file" in refusal(module.main, ["--run", run_folder])


@pytest.mark.parametrize("module", [hold, push, supine])
def test_no_targets(run_folder, refusal, module):
    assert "--targets" in refusal(module.main, ["--run", run_folder, "--targets", 0])


def test_limbs_of_another_task(run_folder, refusal):
    assert "right_leg" in refusal(on_off.main, ["--run", run_folder, "--limb", "right_leg"])
    assert "neck_seated" in refusal(hold.main, ["--run", run_folder, "--limb", "neck_seated"])


# -- timing ----------------------------------------------------------------------------------------------------


def test_a_pair_bears_its_share_of_what_the_first_ones_need(monkeypatch):
    """The clock of a source that needs 10 s before its first pair and 10 ms for each."""
    clock = [0.0]
    monkeypatch.setattr(timing.time, "perf_counter", lambda: clock[0])

    def pairs():
        clock[0] += 10.0
        for _ in count():
            clock[0] += 0.010
            yield

    assert timing.pair_seconds(pairs(), shard=1000) == pytest.approx(0.020)


def test_comparison_by_hand():
    table = timing.compared("orientation", {"controller_paper": 1e-3, "reflex_pair": 0.01, "simulator_step": 1e-3})
    assert table["controller_paper"] == {
        "ours": 1e-3, "bar": 2e-3, "theirs": 2e-3, "ratio": pytest.approx(2.0), "source": "Sec. 4.3.2"
    }  # fmt: skip
    assert table["reflex_pair"]["ratio"] == pytest.approx(30.0) and table["reflex_pair"]["bar"] == 0.04
    assert table["simulator_step"] == {"ours": 1e-3, "bar": None}
    rows = {entry["metric"]: entry for entry in timing.rows_of("core", table)}
    assert rows["controller_paper_s"]["paper"] == "zhou2021" and rows["controller_paper_s"]["sense"] == "max"
    assert rows["controller_paper_theirs_over_ours"]["sense"] == "min"
    assert rows["simulator_step_s"]["sense"] == "info"


def test_timing(run_folder, monkeypatch, capsys):
    """Every measurement once; the numbers themselves are the machine's."""
    monkeypatch.setattr(timing, "median_seconds", lambda call, repeats: (call(), 1e-3)[1])
    monkeypatch.setattr(timing, "pair_seconds", lambda pairs, shard: (next(pairs), 1e-3)[1])
    monkeypatch.setattr(timing, "TARGETS", 2)
    code, _ = run(timing, run_folder, "timing", "--limbs", "right_arm")
    metrics = json.loads(capsys.readouterr().out)
    assert code == 0 and metrics["right_arm"].keys() == timing_figure.PARTS.keys()
