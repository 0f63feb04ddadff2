"""The benchmark: its noise, its turns, its rows, its table of stages."""

import json
import os
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from anthro import cli, scorecard
from anthro.body import benchmark

SOURCE = Path(__file__).resolve().parents[2] / "src"

PENDULUM = """<mujoco><worldbody><body><joint name="j" axis="0 1 0"/><geom size="0.1" pos="0 0 -1"/></body></worldbody>
<actuator><motor joint="j" ctrlrange="0 1"/></actuator></mujoco>"""


@pytest.fixture
def pendulum(monkeypatch):
    """A pendulum in MyoFullBody's place."""
    monkeypatch.setattr(benchmark, "peer_model", lambda: mujoco.MjModel.from_xml_string(PENDULUM))


def test_noise_is_slow_and_bounded():
    signal = benchmark.noise(1000, 7, 0.005, np.random.default_rng(1))
    assert signal.shape == (1000, 7) and signal.min() >= 0.0 and signal.max() <= 1.0
    assert 0.15 < signal.mean() < 0.25
    power = np.abs(np.fft.rfft(signal - signal.mean(axis=0), axis=0)) ** 2
    fast = np.fft.rfftfreq(1000, 0.005) > benchmark.CUTOFF
    assert power[fast].sum() < 0.05 * power.sum()  # what is there comes from clipping at zero


def test_noise_of_a_few_steps_is_there():
    assert benchmark.noise(1, 3, 0.005, np.random.default_rng(1)) == pytest.approx(np.full((1, 3), 0.2))


def test_summary_is_of_rounds():
    factors = {"ours_5ms": [4.0, 6.0, 5.0], benchmark.PEER: [2.0, 2.0, 5.0]}
    assert benchmark.summarize(factors) == {
        "ours_5ms_real_time": 5.0,
        "myofullbody_real_time": 2.0,
        "ours_5ms_over_myofullbody": 2.0,
    }


def test_rows_are_judged(arm):
    medians = {"ours_5ms_real_time": 5.0, "myofullbody_real_time": 2.0, "ours_5ms_over_myofullbody": 0.9}
    judged = {row["metric"]: scorecard.judge(row)["status"] for row in benchmark.rows_of(arm, medians)}
    assert judged == {"ours_5ms_real_time": "pass", "myofullbody_real_time": "", "ours_5ms_over_myofullbody": "near"}


def test_all_take_turns(arm, pendulum):
    factors = benchmark.measure(arm, 0.02, 2, seed=1)
    assert set(factors) == {"ours_5ms", "ours_7ms", benchmark.PEER}
    assert all(len(values) == 2 and min(values) > 0.0 for values in factors.values())


def test_stages_add_up_and_leave_the_rollout_alone(arm):
    parts = benchmark.stages(arm, 0.005, seed=1)
    assert {"kinematics", "tendons", "mass matrix", "bias", "assembly", "solve", "contact", "rest"} < set(parts)
    assert all(seconds >= 0.0 for seconds in parts.values())


def test_files_are_written(arm_folder, pendulum, tmp_path, capsys):
    out = tmp_path / "bench"
    given = ["--body", str(arm_folder), "--seconds", "0.02", "--repeats", "1", "--json", "--out", str(out)]
    assert benchmark.main(given) == 0
    assert set(json.loads(capsys.readouterr().out)) == {"rounds", "medians", "stages_s"}
    assert len(scorecard.collect([out / "rows.json"])) == 5
    assert (out / "run_card.json").is_file()


def test_bad_input_is_told(tmp_path, capsys):
    assert cli.run(benchmark.main, ["--body", "nowhere", "--out", str(tmp_path)]) == 2
    assert "nowhere" in capsys.readouterr().err
    assert cli.run(benchmark.main, ["--body", "nowhere", "--repeats", "0", "--out", str(tmp_path)]) == 2


@pytest.mark.slow
def test_one_core_and_one_thread(arm_folder, tmp_path):
    given = ["--body", str(arm_folder), "--seconds", "0.05", "--repeats", "1", "--out", str(tmp_path)]
    environment = {name: value for name, value in os.environ.items() if name not in benchmark.THREADS}
    done = subprocess.run(
        [sys.executable, "-m", "anthro.body.benchmark", *given],
        env=environment | {"PYTHONPATH": str(SOURCE)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert "myofullbody" in done.stdout and "whole step" in done.stdout
