"""The figure of weak muscles."""

import pytest

from anthro import cli
from anthro.figures.nakada2018 import weakness
from anthro.files import read_json, write_json

OFF = {"core": 40}


def put(run):
    """Write each limb's metrics: success falls, the error grows."""
    for number, limb in enumerate(weakness.LIMBS):
        unit = "m" if limb.startswith("right") else "deg"
        states = [*(f"strength_{percent}" for percent in weakness.STRENGTHS), f"off_{OFF.get(limb, 20)}"]
        metrics = {"limb": limb, "inputs": "paper", "targets": 20}
        for place, state in enumerate(states):
            metrics[f"{state}_success_rate"] = 1.0 - 0.1 * place - 0.05 * number
            metrics[f"{state}_median_error_{unit}"] = 0.01 * 1.5**place
        write_json(run / "demos" / f"weakness_{limb}" / "metrics.json", metrics)


def test_weakness_is_drawn_from_four_limbs(tmp_path):
    put(tmp_path)
    core = weakness.read(tmp_path, "core")
    assert core.off == 40 and weakness.read(tmp_path, "right_arm").off == 20
    assert core.success == pytest.approx([0.85, 0.75, 0.65, 0.55])
    assert core.error == pytest.approx([0.01, 0.015, 0.0225, 0.03375])
    for name in ("a.png", "b.png"):
        assert cli.run(weakness.main, ["--run", str(tmp_path), "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_incomplete_metrics_are_named_in_one_line(tmp_path, capsys):
    put(tmp_path)
    path = tmp_path / "demos" / "weakness_core" / "metrics.json"
    write_json(path, {name: value for name, value in read_json(path).items() if name != "strength_80_success_rate"})
    assert cli.run(weakness.main, ["--run", str(tmp_path), "--out", str(tmp_path / "a.png")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and str(path) in told and "strength_80_success_rate" in told
    path.unlink()
    assert cli.run(weakness.main, ["--run", str(tmp_path), "--out", str(tmp_path / "a.png")]) == 2
