"""The demos' command lines on a run of untrained networks: what they print, write and refuse."""

import itertools
import json
import os

import numpy as np
import pytest

from anthro import cli
from anthro.body import Body
from anthro.demos import choose, hold, on_off, push, reach, timing
from anthro.demos.session import Recorder, Session, row
from anthro.errors import UserError
from anthro.files import read_json, read_shard, write_json
from anthro.motor.network import FeedForward

NETS = ("right_arm_voluntary_paper", "right_arm_voluntary_proprioceptive", "right_arm_reflex")
ROLLOUT = {"time", "qpos", "activation", "hand", "target", "controller_on"}


@pytest.fixture
def short(monkeypatch):
    """Reach for half a second a target."""
    monkeypatch.setattr(reach, "SECONDS", 0.5)


def run(main, run_folder, *more):
    return cli.run(main, [str(a) for a in ["--run", run_folder, *more]])


def weights(run_folder, name):
    return run_folder / "nets" / name / "weights.h5"


# -- reach ------------------------------------------------------------------------------------------


def test_reach_prints_its_metrics_as_json(run_folder, capsys):
    assert run(reach.main, run_folder, "--limb", "right_arm", "--targets", 2, "--seed", 7, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    metrics = {"success_rate", "median_error_m", "p90_error_m", "median_time_s"}
    wanted = metrics | {f"no_reflex_{m}" for m in metrics} | {f"teacher_{m}" for m in metrics}
    assert wanted | {"inputs", "targets", "unreachable_targets"} <= printed.keys()
    assert printed["inputs"] == "proprioceptive" and printed["targets"] == 2
    assert 0.0 <= printed["success_rate"] <= 1.0 and printed["teacher_success_rate"] == 1.0
    assert printed["unreachable_targets"] == []


def test_reach_writes_its_files_and_repeats(run_folder, tmp_path, short, capsys):
    for folder in ("a", "b"):
        assert run(reach.main, run_folder, "--targets", 2, "--inputs", "paper", "--out", tmp_path / folder) == 0
    first, second = tmp_path / "a", tmp_path / "b"
    for name in ("rollout.h5", "metrics.json", "rows.json"):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    columns, attrs = read_shard(first / "rollout.h5")
    assert columns.keys() >= ROLLOUT and attrs["limb"] == "right_arm" and attrs["step_seconds"] == 0.005
    assert columns["qpos"].shape == (200, 7) and columns["activation"].shape == (200, 29)
    assert columns["activation"].min() >= 0.0 and columns["activation"].max() <= 1.0
    assert columns["errors_teacher"].shape == (2, 100) and columns["targets"].shape == (2, 3)
    assert all(np.isfinite(values).all() for values in columns.values())
    rows = read_json(first / "rows.json")
    assert all(entry["paper"] == "nakada2018" for entry in rows)
    bars = {(e["metric"], e["sense"]): e["target"] for e in rows if e["target"] is not None}
    assert bars[("median_error_m", "max")] == 0.015
    rates = [e["target"] for e in rows if e["metric"] == "success_rate" and e["target"] is not None]
    assert sorted(rates) == [0.90, 0.95]
    assert read_json(first / "run_card.json")["seed"] == 7


def test_each_target_begins_where_the_last_one_ended(arm_folder):
    session = Session(None, "right_arm", Body.load(arm_folder))
    silent = type("Silent", (), {"reset": lambda *_: None, "activation": lambda *_: np.zeros(29)})()
    recorder = Recorder(None)
    targets = reach.random_targets(session, 2, seed=3)
    errors = reach.reach(session, silent, targets, "silent", recorder)
    columns = recorder.columns()
    steps = errors.shape[1]
    assert columns["time"][steps] == pytest.approx(1.5)
    np.testing.assert_allclose(np.linalg.norm(columns["hand"][steps] - targets[0]), errors[0, -1], atol=1e-12)


def test_targets_are_of_the_seed_and_lie_in_reach(arm_folder):
    session = Session(None, "right_arm", Body.load(arm_folder))
    targets = reach.random_targets(session, 50, seed=7)
    np.testing.assert_array_equal(targets[:10], reach.random_targets(session, 10, seed=7))
    assert not np.array_equal(targets, reach.random_targets(session, 50, seed=8))
    assert np.linalg.norm(targets - targets.mean(0), axis=1).max() < 1.0


def test_summary_by_hand():
    """Steps of 5 ms: one target entered after 0.1 s, one left at 5 cm, one passed by and lost."""
    errors = np.full((3, 300), 0.05)
    errors[0, 19:] = 0.01
    errors[2, 100:110] = 0.0
    found = reach.summary(errors)
    assert found["success_rate"] == pytest.approx(1.0 / 3.0)
    assert found["median_error_m"] == pytest.approx(0.05)
    assert found["median_time_s"] == pytest.approx(0.1)
    assert reach.summary(np.full((2, 300), 0.05))["median_time_s"] is None


def test_settled_error_is_the_mean_of_the_last_quarter_second():
    errors = np.zeros((1, 300))
    errors[0, 250:] = np.linspace(0.0, 0.04, 50)
    errors[0, :250] = 9.0
    assert reach.settled_error(errors)[0] == pytest.approx(0.02)


def test_unreachable_target_is_listed_and_no_error(run_folder, short, capsys):
    arguments = ["--target", 0.1, -0.2, 1.1, "--target", 2, 0, 1, "--json"]
    assert run(reach.main, run_folder, *arguments) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["unreachable_targets"] == [1] and printed["targets"] == 2


# -- bad input --------------------------------------------------------------------------------------

DEMOS = {"reach": reach.main, "hold": hold.main, "push": push.main, "on_off": on_off.main, "timing": timing.main}


@pytest.mark.parametrize("demo", DEMOS)
def test_unknown_limb_and_missing_run(run_folder, tmp_path, refusal, demo):
    line = refusal(DEMOS[demo], ["--run", run_folder, "--limb", "left_tail"])
    assert "left_tail" in line and "right_arm" in line
    assert "norun" in refusal(DEMOS[demo], ["--run", tmp_path / "norun"])


@pytest.mark.parametrize("demo", DEMOS)
def test_missing_weights_are_named(run_folder, tmp_path, refusal, demo):
    for name in NETS:
        weights(run_folder, name).unlink()
    assert "weights.h5: no such file" in refusal(DEMOS[demo], ["--run", run_folder, "--out", tmp_path / "out"])
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
    assert name in refusal(reach.main, ["--run", run_folder, "--inputs", inputs, "--targets", 1])


@pytest.mark.parametrize(
    ("target", "told"),
    [(("nan", 0, 1), "target 1 is not finite"), ((0, "inf", 1), "target 1 is not finite")],
)
def test_targets_that_are_no_points(run_folder, refusal, target, told):
    assert told in refusal(reach.main, ["--run", run_folder, "--target", *target])
    line = refusal(reach.main, ["--run", run_folder, "--target", 0.1, -0.2, 1.1, "--target", *target])
    assert "target 2" in line


@pytest.mark.parametrize("demo", ["reach", "hold", "push"])
@pytest.mark.parametrize("count", [0, -3])
def test_no_targets(run_folder, refusal, demo, count):
    assert "--targets" in refusal(DEMOS[demo], ["--run", run_folder, "--targets", count])


@pytest.mark.parametrize("arguments", [["--inputs", "both"], ["--targets", "many"], ["--target", "0", "1"]])
def test_arguments_of_another_type_exit_with_2(run_folder, capsys, arguments):
    with pytest.raises(SystemExit) as stop:
        run(reach.main, run_folder, *arguments)
    assert stop.value.code == 2


def test_body_that_is_not_built(run_folder, refusal):
    (run_folder / "body" / "right_arm").unlink()
    assert "right_arm" in refusal(reach.main, ["--run", run_folder, "--targets", 1])


# -- which inputs -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("paper", "proprioceptive", "wins"),
    [
        ((0.9, 0.02), (0.8, 0.01), "paper"),
        ((0.8, 0.01), (0.9, 0.02), "proprioceptive"),
        ((0.9, 0.01), (0.9, 0.02), "paper"),  # the smaller median error decides a tie
        ((0.9, 0.03), (0.9, 0.02), "proprioceptive"),
    ],
)
def test_the_better_inputs_are_chosen(run_folder, tmp_path, paper, proprioceptive, wins):
    paths = []
    for inputs, (rate, error) in (("paper", paper), ("proprioceptive", proprioceptive)):
        paths.append(tmp_path / f"{inputs}.json")
        write_json(paths[-1], {"inputs": inputs, "success_rate": rate, "median_error_m": error})
    out = run_folder / "demos" / "choice.json"
    for order in (paths, paths[::-1]):
        assert choose.main(["--metrics", *map(str, order), "--out", str(out)]) == 0
        assert read_json(out) == {"inputs": wins}
    session = Session.open(run_folder, "right_arm")
    assert session.chosen_inputs(None) == wins
    assert session.chosen_inputs("paper") == "paper"


def test_choosing_from_what_is_not_there(tmp_path, refusal):
    assert "none.json" in refusal(choose.main, ["--metrics", tmp_path / "none.json", "--out", tmp_path / "o.json"])


# -- hold, push, on and off ---------------------------------------------------------------------------


def finite(metrics, but=()):
    return all(np.isfinite(v) for k, v in metrics.items() if not isinstance(v, str) and k not in but)


def test_hold(run_folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(hold, "HOLD_SECONDS", 1.0)
    assert run(hold.main, run_folder, "--targets", 2, "--out", tmp_path, "--json") == 0
    metrics = json.loads(capsys.readouterr().out)
    assert finite(metrics) and metrics == read_json(tmp_path / "metrics.json")
    columns, _ = read_shard(tmp_path / "rollout.h5")
    assert columns["time"].shape == (2 * 600,) and np.isfinite(columns["qpos"]).all()
    assert {entry["target"] for entry in read_json(tmp_path / "rows.json")} == {0.01}


def test_drift_by_hand(arm):
    recorder = Recorder(arm.simulator())
    recorder.rows = [(0.0, None, None, np.array([x, 0.0, 0.0]), None, True) for x in (9.0, 0.1, 0.13, 0.08, 0.1)]
    assert hold.drift(recorder, 4) == pytest.approx(0.03)


def test_push(run_folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(push, "WATCH_SECONDS", 0.5)
    assert run(push.main, run_folder, "--targets", 2, "--out", tmp_path, "--json") == 0
    metrics = json.loads(capsys.readouterr().out)
    assert finite(metrics, but={"median_recovery_s"})
    assert metrics["median_recovery_s"] is None or metrics["median_recovery_s"] >= 0.0
    columns, _ = read_shard(tmp_path / "rollout.h5")
    assert columns["time"].shape == (2 * 220,) and np.isfinite(columns["qpos"]).all()
    bar = next(entry for entry in read_json(tmp_path / "rows.json") if entry["target"] is not None)
    assert (bar["metric"], bar["target"], bar["sense"]) == ("recovered_within_1_s", 1.0, "min")


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


def test_on_off_falls_in_gravity(run_folder, tmp_path, capsys):
    assert run(on_off.main, run_folder, "--out", tmp_path, "--json") == 0
    metrics = json.loads(capsys.readouterr().out)
    assert finite(metrics, but={"seconds_to_lift_again"})
    columns, _ = read_shard(tmp_path / "rollout.h5")
    off = columns["controller_on"] == 0
    assert off.sum() == 600 and not columns["activation"][off].any()
    assert columns["hand"][off][-1, 2] < 1.0  # it hangs: the shoulder is at 1.4 m
    assert np.isfinite(columns["qpos"]).all()
    assert {entry["metric"] for entry in read_json(tmp_path / "rows.json")} >= {"fall_m", "error_lifted_again_m"}


@pytest.mark.parametrize(("errors", "seconds"), [([0.5, 0.02, 0.02], 0.01), ([0.5, 0.5, 0.5], None)])
def test_time_to_the_radius_is_none_when_never(errors, seconds):
    found = reach.time_to_radius(np.array(errors))
    assert found is None if seconds is None else found == pytest.approx(seconds)


def test_timing(run_folder, tmp_path, monkeypatch, capsys):
    """Every measurement once; the numbers themselves are the machine's."""
    monkeypatch.setattr(timing, "median_seconds", lambda call, repeats: (call(), 1e-3)[1])
    monkeypatch.setattr(timing, "mean_seconds", lambda items, count: len(list(itertools.islice(items, 2))) * 1e-3)
    assert run(timing.main, run_folder, "--out", tmp_path, "--json") == 0
    metrics = json.loads(capsys.readouterr().out)
    assert {"both_networks_paper_s", "both_networks_proprioceptive_s", "teacher_label_s"} <= metrics.keys()
    assert {"voluntary_pair_teacher_s", "voluntary_pair_students_s", "reflex_pair_s"} <= metrics.keys()
    rows = {entry["metric"]: entry["target"] for entry in read_json(tmp_path / "rows.json")}
    assert rows["both_networks_paper_s"] == 0.3e-3 and rows["simulator_speed"] == 30.0


# -- what they share ----------------------------------------------------------------------------------


def test_a_scorecard_row_without_a_value():
    assert row("reach", "median_time_s", None, "s")["value"] is None
    assert row("reach", "success_rate", np.float32(0.5), "1", 0.9, "min")["value"] == 0.5


def test_a_full_disk_keeps_the_older_results(run_folder, tmp_path, short, refusal, monkeypatch, capsys):
    assert run(reach.main, run_folder, "--targets", 1, "--out", tmp_path / "out") == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}

    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    refused = ["--run", run_folder, "--targets", 2, "--out", tmp_path / "out"]
    capsys.readouterr()
    assert cli.run(reach.main, [str(a) for a in refused]) == 2
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error:")]
    assert len(errors) == 1 and "No space left" in errors[0]
    monkeypatch.undo()
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


def test_session_names_what_is_missing(tmp_path):
    with pytest.raises(UserError, match="no such run"):
        Session.open(tmp_path / "none", "right_arm")
