"""The limbs' tasks on a run of untrained networks: what they print, write, choose and refuse."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anthro import cli, registry
from anthro.demos import all_six, choose, core, head, reach, weakness
from anthro.demos import attempt as attempt_module
from anthro.demos.attempt import Staged, attempt, hold
from anthro.demos.criterion import TASKS, task_of, time_to_radius
from anthro.demos.quality import Gauge, minimum_jerk_shape, speed_shape
from anthro.demos.session import Recorder, Session, row
from anthro.demos.task import rows_of, unit_of
from anthro.errors import UserError
from anthro.files import read_json, read_shard, write_json
from anthro.motor.network import FeedForward
from anthro.motor.others import Company, Others

NETS = tuple(registry.limb("right_arm").nets.values())
ROLLOUT = {"time", "qpos", "activation", "effector", "target", "controller_on"}
ARM = ("--body", "right_arm")
SUMMARY = {"success_rate", "median_error_m", "p90_error_m", "median_time_s"}


@pytest.fixture
def short(monkeypatch):
    """Half a second a target, one of standing still."""
    for senses, task in TASKS.items():
        monkeypatch.setitem(TASKS, senses, replace(task, seconds=0.5, compared=1))
    monkeypatch.setattr(attempt_module, "HOLD_SECONDS", 1.2)
    monkeypatch.setattr(all_six, "SECONDS", 0.5)


def run(main, run_folder, *more):
    return cli.run(main, [str(a) for a in ["--run", run_folder, *more]])


def weights(run_folder, name):
    return run_folder / "nets" / name / "weights.h5"


class Silent:
    """A policy that leaves its limb limp."""

    def __init__(self, limb):
        self.limb = limb

    def reset(self, simulator, drive=None):
        self.begun = drive

    def activation(self, simulator, target):
        return np.zeros(self.limb.size)


# -- criteria -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limb", "name", "radius", "seconds", "share", "bar"),
    [
        ("right_leg", "reach", 0.03, 1.5, 0.7, 0.90),
        ("neck", "head", np.pi / 90, 1.5, 0.6, 0.90),
        ("core", "core", np.pi / 60, 3.0, 0.4, 0.85),
    ],
)
def test_each_limb_has_its_task(limb_keys, limb, name, radius, seconds, share, bar):
    task = TASKS[limb_keys(limb)["senses"]]
    assert (task.name, task.seconds, task.share, task.bar) == (name, seconds, share, bar)
    assert task.radius == pytest.approx(radius)


def test_summary_by_hand():
    """Steps of 5 ms: one target entered after 0.1 s, one left at 5 cm, one passed by and lost."""
    errors = np.full((3, 300), 0.05)
    errors[0, 19:] = 0.01
    errors[2, 100:110] = 0.0
    found = TASKS["position"].summary(errors)
    assert found["success_rate"] == pytest.approx(1.0 / 3.0)
    assert found["median_error_m"] == pytest.approx(0.05)
    assert found["median_time_s"] == pytest.approx(0.1)
    lost = TASKS["gaze"].summary(np.full((2, 300), np.deg2rad(5.0)), "x_")
    assert lost["x_median_time_s"] is None and lost["x_p90_error_deg"] == pytest.approx(5.0)


def test_a_target_is_judged_by_the_last_quarter_second():
    errors = np.zeros((1, 300))
    errors[0, 250:] = np.linspace(0.0, 0.04, 50)
    errors[0, :250] = 9.0
    assert TASKS["position"].summary(errors)["median_error_m"] == pytest.approx(0.02)
    assert TASKS["position"].met(errors).all()


@pytest.mark.parametrize(("errors", "seconds"), [([0.5, 0.02, 0.02], 0.01), ([0.5, 0.5, 0.5], None)])
def test_time_to_the_radius_is_none_when_never(errors, seconds):
    assert time_to_radius(errors) == (None if seconds is None else pytest.approx(seconds))


# -- how a limb moves ---------------------------------------------------------------------------------


def along_x(way):
    return np.asarray(way)[:, None] * [1.0, 0.0, 0.0]


def test_minimum_jerk_is_1_875_uncut_and_a_little_less_cut():
    t = np.linspace(0.0, 1.0, 1001)
    way = t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    assert np.diff(way).max() / np.diff(way).mean() == pytest.approx(1.875, rel=1e-3)
    # cut where 30 t^2 (1 - t)^2 is 5 % of its peak: t (1 - t) = sqrt(0.05) / 4
    start = 0.5 - np.sqrt(0.25 - np.sqrt(0.05) / 4.0)
    gone = 1.0 - 2.0 * np.interp(start, t, way)
    assert minimum_jerk_shape() == pytest.approx(1.875 * (1.0 - 2.0 * start) / gone, rel=2e-3)


def test_speed_shapes_by_hand():
    assert speed_shape(along_x(np.arange(50) * 0.01), 0.005)[0] == pytest.approx(1.0)
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    ratio, peaks = speed_shape(along_x(t - 0.5 * np.sin(2.0 * t)), 0.005)  # speed 1 - cos 2t: two bumps
    # above 0.1 from t = 0.2255 on: 2 over the mean (2 pi - 0.451 + sin 0.451) / (2 pi - 0.451)
    assert peaks == 2 and ratio == pytest.approx(1.861, rel=5e-3)
    ratio, _ = speed_shape(along_x([0.0] * 50 + list(np.arange(50) * 0.01)), 0.005)  # rest is no part of a movement
    assert ratio == pytest.approx(1.0)


def test_gauge_by_hand(limb):
    arm = limb("right_arm", "nakada2018")
    simulator = arm.body.simulator()
    gauge = Gauge(simulator, arm)
    for level in (0.1, 0.2):
        activation = np.full(arm.body.muscle_count, 0.9)
        activation[arm.muscles] = level
        gauge.take(activation, {})
    np.testing.assert_allclose(gauge.effort, [29 * 0.01, 29 * 0.04])
    np.testing.assert_allclose(gauge.change, [0.0, (0.1 / 0.005) ** 2])
    np.testing.assert_allclose(gauge.path[0], simulator.effector_position("hand_r"))


# -- attempts -----------------------------------------------------------------------------------------


def test_each_target_begins_where_the_last_one_ended(limb):
    arm = limb("right_arm")
    simulator = arm.body.simulator()
    recorder, targets = Recorder(simulator, [arm]), [np.array([0.3, -0.2, 1.2]), np.array([0.2, -0.4, 1.0])]
    tried = attempt(simulator, Staged(arm.body, {"right_arm": Silent(arm)}), arm, targets, "silent", recorder)
    columns = recorder.columns()
    steps = tried.distance.shape[1]
    assert tried.distance.shape == (2, 300) and tried.path.shape == (2, 300, 3)
    assert columns["time"][steps] == pytest.approx(1.5)
    np.testing.assert_allclose(
        np.linalg.norm(columns["effector"][steps] - targets[0]), tried.distance[0, -1], atol=1e-12
    )
    np.testing.assert_allclose(columns["effector"][:, 0], tried.path.reshape(-1, 3))


def test_a_recorder_may_leave_steps_out(arm):
    recorder = Recorder(arm.simulator(), [], every=4)
    for _ in range(9):
        recorder.take(np.zeros(29), {})
        recorder.simulator.step(np.zeros(29))
    np.testing.assert_allclose(recorder.columns()["time"], [0.0, 0.02, 0.04])
    assert recorder.attrs(7)["step_seconds"] == pytest.approx(0.02)


def test_others_move_beside_a_limb_and_silent_muscles_never_do(limb):
    torso = limb("core")
    simulator = torso.body.simulator()
    silent = torso.muscles[:5]

    class Full(Silent):
        def activation(self, simulator, target):
            return np.ones(self.limb.size)

    others = Others(torso, Company(0.4, (0.8, 2.0), 0.05), np.random.default_rng(1))
    system = Staged(torso.body, {"core": Full(torso)}, others, silent)
    system.reset(simulator)
    found = system.activation(simulator, {"core": np.eye(3)})
    rest = np.setdiff1d(np.arange(torso.body.muscle_count), torso.muscles)
    assert not found[silent].any() and (found[np.setdiff1d(torso.muscles, silent)] == 1.0).all()
    assert (found[rest] > 0.0).mean() > 0.5
    np.testing.assert_allclose(found[rest], 0.05, atol=0.05)  # near the threshold at the first step


def test_hold_by_hand(monkeypatch, limb):
    """Offsets 0.01 in the first second, then one of 0.03: 0.03 from the target, 0.02 from the first second."""
    script = [np.array([0.01, 0.0])] * 200 + [np.array([0.03, 0.0])] * 10

    class Scripted:
        name, plan = "neck", limb("neck").plan

        def offset(self, data, target):
            return script[len(seen)]

    seen = []

    def advance(simulator, system, targets, seconds, recorder=None):
        for _ in script if recorder else ():
            recorder.take(None, targets)
            seen.append(1)

    monkeypatch.setattr(attempt_module, "advance", advance)
    simulator = limb("neck").body.simulator()
    assert hold(simulator, None, Scripted(), np.array([1.0, 0.0, 0.0])) == pytest.approx((0.03, 0.02))


def test_limbs_begin_slack_but_for_the_core(run_folder):
    session = Session.open(run_folder, "whole_fixed")
    policies = {name: Silent(session.limb(name)) for name in ("core", "right_arm")}
    simulator = session.begin(Staged(session.body, policies))
    assert policies["right_arm"].begun is None and policies["core"].begun.shape == (443,)
    assert not simulator.qvel.any()
    driven = session.limb("core").driven
    np.testing.assert_allclose(simulator.joint_angles[driven], session.body.q_rest[driven])


def test_targets_are_of_the_seed_and_lie_in_reach(run_folder):
    session = Session.open(run_folder, "right_arm")
    targets = np.array(session.targets("right_arm", 20, 0.7, 7, "reach"))
    np.testing.assert_array_equal(targets[:5], session.targets("right_arm", 5, 0.7, 7, "reach"))
    assert not np.array_equal(targets, session.targets("right_arm", 20, 0.7, 8, "reach"))
    assert np.linalg.norm(targets - targets.mean(0), axis=1).max() < 1.0


# -- reach --------------------------------------------------------------------------------------------


def test_reach_prints_its_metrics_as_json(run_folder, capsys):
    assert run(reach.main, run_folder, *ARM, "--targets", 2, "--seed", 7, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    wanted = SUMMARY | {f"{who}_{m}" for m in SUMMARY for who in ("no_reflex", "plain", "teacher", "appendix_b")}
    assert wanted | {"limb", "inputs", "targets", "unreachable_targets"} <= printed.keys()
    assert {"effort", "effort_over_teacher", "activation_rate_per_s", "speed_peak_over_mean"} <= printed.keys()
    assert printed["inputs"] == "proprioceptive" and printed["targets"] == printed["compared_targets"] == 2
    assert 0.0 <= printed["success_rate"] <= 1.0 and printed["teacher_success_rate"] == 1.0
    assert printed["unreachable_targets"] == []


def test_reach_writes_its_files_and_repeats(run_folder, tmp_path, short):
    for folder in ("a", "b"):
        assert run(reach.main, run_folder, *ARM, "--targets", 2, "--inputs", "paper", "--out", tmp_path / folder) == 0
    first, second = tmp_path / "a", tmp_path / "b"
    for name in ("rollout.h5", "metrics.json", "rows.json"):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    columns, attrs = read_shard(first / "rollout.h5")
    assert columns.keys() >= ROLLOUT and attrs["limbs"] == attrs["body"] == "right_arm"
    assert attrs["step_seconds"] == pytest.approx(0.02)
    assert columns["qpos"].shape == (50, 7) and columns["activation"].shape == (50, 29)
    assert columns["effector"].shape == columns["target"].shape == (50, 1, 3)
    assert columns["activation"].min() >= 0.0 and columns["activation"].max() <= 1.0
    assert columns["errors_paper"].shape == (2, 100) and columns["targets"].shape == (2, 3)
    assert columns["errors_paper_no_reflex"].shape == columns["errors_teacher"].shape == (1, 100)
    assert all(np.isfinite(values).all() for values in columns.values())
    rows = read_json(first / "rows.json")
    assert all(entry["paper"] == "nakada2018" for entry in rows)
    bars = {entry["metric"]: (entry["target"], entry["sense"]) for entry in rows if entry["target"] is not None}
    assert bars == {"success_rate": (0.90, "min"), "median_error_m": (0.015, "max")}
    assert read_json(first / "run_card.json")["seed"] == 7


def test_reach_on_the_seated_body(run_folder, tmp_path, short):
    assert run(reach.main, run_folder, "--limb", "left_leg", "--targets", 1, "--out", tmp_path / "out") == 0
    columns, attrs = read_shard(tmp_path / "out" / "rollout.h5")
    assert attrs["body"] == "nakada2018" and attrs["limbs"] == "left_leg"
    session = Session.open(run_folder, "nakada2018")
    limp = np.setdiff1d(np.arange(352), session.limb("left_leg").muscles)
    assert columns["activation"].shape == (25, 352) and not columns["activation"][:, limp].any()


def test_unreachable_target_is_listed_and_no_error(run_folder, short, capsys):
    arguments = [*ARM, "--target", 0.1, -0.2, 1.1, "--target", 2, 0, 1, "--json"]
    assert run(reach.main, run_folder, *arguments) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["unreachable_targets"] == [1] and printed["targets"] == 2


# -- head and core ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limb", "body", "paper"), [("neck_seated", "nakada2018", "nakada2018"), ("neck", "neck", "zhou2021")]
)
def test_head(run_folder, tmp_path, short, limb, body, paper):
    assert run(head.main, run_folder, "--limb", limb, "--targets", 1, "--out", tmp_path / "out") == 0
    metrics = read_json(tmp_path / "out" / "metrics.json")
    assert {"success_rate", "median_error_deg", "no_reflex_success_rate", "teacher_success_rate"} <= metrics.keys()
    assert metrics["held_error_deg"] >= 0.0 and metrics["held_deviation_deg"] >= 0.0
    columns, attrs = read_shard(tmp_path / "out" / "rollout.h5")
    assert attrs["body"] == body and np.isfinite(columns["target"]).all()
    rows = read_json(tmp_path / "out" / "rows.json")
    bars = {entry["metric"]: (entry["target"], entry["sense"]) for entry in rows if entry["target"] is not None}
    assert bars == {"success_rate": (0.90, "min"), "held_deviation_deg": (1.0, "max")}
    assert {entry["paper"] for entry in rows} == {paper}


def test_core(run_folder, tmp_path, short):
    assert run(core.main, run_folder, "--targets", 1, "--out", tmp_path / "out") == 0
    columns, attrs = read_shard(tmp_path / "out" / "rollout.h5")
    assert attrs["body"] == "whole_fixed" and columns["targets"].shape == (1, 3, 3)
    own = Session.open(run_folder, "whole_fixed").limb("core").muscles
    others = np.setdiff1d(np.arange(823), own)
    assert columns["activation"].shape == (25, 823) and columns["activation"][:, others].max() > 0.1
    rows = read_json(tmp_path / "out" / "rows.json")
    bars = {entry["metric"]: (entry["target"], entry["sense"]) for entry in rows if entry["target"] is not None}
    assert bars == {"success_rate": (0.85, "min"), "held_error_deg": (2.0, "max")}
    assert {entry["paper"] for entry in rows} == {"zhou2021"}


def test_a_limb_of_another_task_is_refused(run_folder, refusal):
    assert "the task of core is core" in refusal(head.main, ["--run", run_folder, "--limb", "core"])
    assert "the task of neck is head" in refusal(reach.main, ["--run", run_folder, "--limb", "neck"])


# -- all six ------------------------------------------------------------------------------------------


def test_targets_of_a_round_are_of_one_pose(run_folder):
    """Seen from the turned chest, the head's target lies within the neck's reach."""
    session = Session.open(run_folder, "whole_fixed")
    found = all_six.rounds(session, 3, seed=7)
    scratch = session.simulator()
    upright = session.limb("core").feature(scratch.data)
    kinematics = session.teacher("neck").kinematics
    turns = []
    for targets in found:
        assert targets.keys() == set(all_six.LIMBS)
        turn = targets["core"] @ upright.T
        turns.append(Rotation.from_matrix(turn).magnitude())
        assert kinematics.solve(turn.T @ targets["neck"]).error < np.deg2rad(1.0)
    assert max(turns) > np.deg2rad(5.0)


def test_all_six(run_folder, tmp_path, short):
    assert run(all_six.main, run_folder, "--targets", 2, "--out", tmp_path / "out") == 0
    metrics = read_json(tmp_path / "out" / "metrics.json")
    assert metrics["not_finite"] == 0.0 and metrics["active_force_above_allowed"] <= 1e-9
    assert metrics["core_inputs"] == "proprioceptive" and metrics["neck_median_error_deg"] >= 0.0
    rows = read_json(tmp_path / "out" / "rows.json")
    bars = {entry["metric"]: entry["target"] for entry in rows if entry["sense"] == "min"}
    assert bars["left_leg_success_rate"] == pytest.approx(0.72) and bars["core_success_rate"] == pytest.approx(0.68)
    assert len(bars) == 6
    columns, attrs = read_shard(tmp_path / "out" / "rollout.h5")
    assert attrs["limbs"].split() == list(all_six.LIMBS) and columns["effector"].shape == (50, 6, 3)
    assert columns["errors_neck"].shape == (2, 100)


def test_watch_by_hand(arm):
    simulator = arm.simulator()
    watch = all_six.Watch(simulator)
    watch.take(np.ones(29), {})
    assert watch.above_allowed < 1e-9 and watch.not_finite == 0
    assert watch.over_strength == pytest.approx(((0.7 + simulator.strain) / 0.7).max())
    watch.take(np.full(29, 2.0), {})
    assert watch.above_allowed == pytest.approx(watch.over_strength / 2.0)
    watch.take(np.array([np.nan] + [0.0] * 28), {})
    assert watch.not_finite == 1


# -- weakness -----------------------------------------------------------------------------------------


def test_conditions_by_hand(limb):
    arm = limb("right_arm", "nakada2018")
    full, weak, weaker, off = weakness.conditions(arm, seed=7)
    assert [one.strength for one in (full, weak, weaker, off)] == [1.0, 0.8, 0.6, 1.0]
    assert len(off.silent) == 6 and set(off.silent) <= set(arm.muscles) and not full.silent
    assert off == weakness.conditions(arm, seed=7)[3] != weakness.conditions(arm, seed=8)[3]
    force, rest = weaker.body(arm).max_force, np.setdiff1d(np.arange(352), arm.muscles)
    np.testing.assert_allclose(force[arm.muscles], 0.6 * arm.body.max_force[arm.muscles])
    np.testing.assert_array_equal(force[rest], arm.body.max_force[rest])
    assert len(weakness.conditions(limb("core"), 7)[3].silent) == 177  # 40 % of 443


def test_weakness(run_folder, tmp_path, short):
    assert run(weakness.main, run_folder, *ARM, "--targets", 2, "--out", tmp_path / "out") == 0
    metrics = read_json(tmp_path / "out" / "metrics.json")
    for name in ("strength_100", "strength_80", "strength_60", "off_20"):
        assert 0.0 <= metrics[f"{name}_success_rate"] <= 1.0 and metrics[f"{name}_median_error_m"] > 0.0
    errors = {metrics[f"{name}_median_error_m"] for name in ("strength_100", "strength_60", "off_20")}
    assert len(errors) == 3
    assert all(entry["sense"] == "info" for entry in read_json(tmp_path / "out" / "rows.json"))


# -- bad input ----------------------------------------------------------------------------------------

DEMOS = {"reach": reach.main, "head": head.main, "core": core.main, "weakness": weakness.main}


@pytest.mark.parametrize("demo", DEMOS)
def test_unknown_limb_and_missing_run(run_folder, tmp_path, refusal, demo):
    line = refusal(DEMOS[demo], ["--run", run_folder, "--limb", "left_tail"])
    assert "left_tail" in line and "right_arm" in line
    assert "norun" in refusal(DEMOS[demo], ["--run", tmp_path / "norun"])


@pytest.mark.parametrize("demo", [reach.main, weakness.main])
def test_missing_weights_are_named(run_folder, tmp_path, refusal, demo):
    for name in NETS:
        weights(run_folder, name).unlink()
    asked = ["--run", run_folder, *ARM, "--targets", 1, "--out", tmp_path / "out"]
    assert "weights.h5: no such file" in refusal(demo, asked)
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("name", NETS)
@pytest.mark.parametrize("damage", ["shape", "truncated", "not finite"])
def test_damaged_weights_are_named(run_folder, refusal, name, damage):
    path = weights(run_folder, name)
    whole = path.read_bytes()
    if damage == "truncated":
        path.write_bytes(whole[: len(whole) // 2])
    elif damage == "shape":
        FeedForward([np.zeros((29, 33))], [np.zeros(29)]).save(path)
    else:
        net = FeedForward.load(path)
        FeedForward([np.full((29, net.n_in), np.nan)], [np.zeros(29)]).save(path)
    inputs = "paper" if name.endswith("paper") else "proprioceptive"
    assert name in refusal(reach.main, ["--run", run_folder, *ARM, "--inputs", inputs, "--targets", 1])


@pytest.mark.parametrize("target", [("nan", 0, 1), (0, "inf", 1)])
def test_targets_that_are_no_points(run_folder, refusal, target):
    assert "target 1 is not finite" in refusal(reach.main, ["--run", run_folder, "--target", *target])
    line = refusal(reach.main, ["--run", run_folder, "--target", 0.1, -0.2, 1.1, "--target", *target])
    assert "target 2" in line


@pytest.mark.parametrize("demo", [*DEMOS.values(), all_six.main])
@pytest.mark.parametrize("count", [0, -3])
def test_no_targets(run_folder, refusal, demo, count):
    assert "--targets" in refusal(demo, ["--run", run_folder, "--targets", count])


@pytest.mark.parametrize("arguments", [["--inputs", "both"], ["--targets", "many"], ["--target", "0", "1"]])
def test_arguments_of_another_type_exit_with_2(run_folder, arguments):
    with pytest.raises(SystemExit) as stop:
        run(reach.main, run_folder, *arguments)
    assert stop.value.code == 2


def test_body_that_is_not_built(run_folder, refusal):
    (run_folder / "body" / "nakada2018").unlink()
    assert "nakada2018" in refusal(reach.main, ["--run", run_folder, "--targets", 1])


# -- which inputs -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("paper", "proprioceptive", "wins"),
    [
        ((0.9, 0.02), (0.8, 0.01), "paper"),
        ((0.8, 0.01), (0.9, 0.02), "proprioceptive"),
        ((0.9, 0.01), (0.9, 0.02), "paper"),  # the smaller median error decides a tie
        ((0.9, 0.03), (0.9, 0.02), "proprioceptive"),
    ],
)
def test_the_better_inputs_are_chosen_limb_by_limb(run_folder, tmp_path, paper, proprioceptive, wins):
    found = {
        net: {"success_rate": 0.9 if net.endswith("paper") else 0.5, "median_error_deg": 1.0}
        for net, told in registry.NETS.items()
        if told.role == "voluntary" and not registry.LIMBS[told.limb].mirror_of
    }
    for inputs, (rate, error) in (("paper", paper), ("proprioceptive", proprioceptive)):
        found[f"right_arm_voluntary_{inputs}"] = {"success_rate": rate, "median_error_m": error}
    paths = [tmp_path / net / "selection.json" for net in found]
    for path, metrics in zip(paths, found.values(), strict=True):
        write_json(path, {"kept": 1, "rounds": [{"success_rate": 1.0, "median_error_m": 0.0}, metrics]})
    out = run_folder / "demos" / "choice.json"
    for order in (paths, paths[::-1]):
        assert choose.main(["--selections", *map(str, order), "--out", str(out)]) == 0
        chosen = read_json(out)
        assert (chosen["right_arm"], chosen["left_arm"], chosen["core"]) == (wins, wins, "paper")
    session = Session.open(run_folder, "right_arm")
    assert session.chosen_inputs("right_arm") == wins
    assert session.chosen_inputs("right_arm", "paper") == "paper"


def test_choosing_from_what_is_not_there(tmp_path, refusal):
    out = ["--out", tmp_path / "o.json"]
    assert "none.json" in refusal(choose.main, ["--selections", tmp_path / "none.json", *out])
    for name in ("core_voluntary_paper", "."):
        path = tmp_path / name / "selection.json"
        write_json(path, {"kept": 0})
        assert "voluntary nets" in refusal(choose.main, ["--selections", path, *out])


# -- what they share ----------------------------------------------------------------------------------


def test_rows_of_metrics():
    metrics = {"targets": 3, "success_rate": 0.5, "median_time_s": None, "activation_rate_per_s": 2.0, "limb": "neck"}
    rows = {entry["metric"]: entry for entry in rows_of(metrics, "x", "p", "s", {"success_rate": (0.9, "min")})}
    assert rows.keys() == {"success_rate", "median_time_s", "activation_rate_per_s"}
    assert rows["success_rate"]["target"] == 0.9 and rows["median_time_s"]["value"] is None
    assert [unit_of(name) for name in rows] == ["1", "s", "1/s"] and unit_of("held_error_deg") == "deg"


def test_a_scorecard_row_without_a_value():
    assert row("reach", "median_time_s", None, "s")["value"] is None
    assert row("reach", "success_rate", np.float32(0.5), "1", 0.9, "min")["value"] == 0.5


def test_a_full_disk_keeps_the_older_results(run_folder, tmp_path, short, monkeypatch, capsys):
    asked = [*ARM, "--out", tmp_path / "out"]
    assert run(reach.main, run_folder, *asked, "--targets", 1) == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}

    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    capsys.readouterr()
    assert run(reach.main, run_folder, *asked, "--targets", 2) == 2
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error:")]
    assert len(errors) == 1 and "No space left" in errors[0]
    monkeypatch.undo()
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


def test_session_names_what_is_missing(tmp_path):
    with pytest.raises(UserError, match="no such run"):
        Session.open(tmp_path / "none", "right_arm")


def test_task_of_a_limb(limb):
    assert task_of(limb("right_arm")) is TASKS["position"]
