"""Curves, the findings of Appendix A, and the figures drawn from them."""

import csv
import importlib
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro import cli, registry
from anthro.errors import UserError
from anthro.files import read_json, write_json
from anthro.learn import findings
from anthro.learn.curves import Trial, common_level, read_losses, read_table
from anthro.scorecard import judge

EPOCHS = 30


def curve(best=0.1, speed=0.3, seconds=1.0, epochs=EPOCHS) -> dict[str, np.ndarray]:
    epoch = np.arange(1, epochs + 1.0)
    mse = best + (1 - best) * np.exp(-speed * epoch)
    return {
        "epoch": epoch,
        "train_mse": 0.9 * mse,
        "validation_mse": mse,
        "unexplained_variance": mse,
        "learning_rate": np.full(epochs, 1e-3),
        "seconds": seconds * np.linspace(0.95, 1.05, epochs),
    }


def weights(hidden) -> int:
    sizes = (32, *hidden, 29)
    return sum(a * b for a, b in zip(sizes, sizes[1:], strict=False))


def put(folder, losses, hidden=(300,) * 6, learning_rate=1e-3):
    folder.mkdir(parents=True)
    with open(folder / "loss.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(losses)
        writer.writerows(zip(*losses.values(), strict=True))
    spec = {"hidden": list(hidden), "learning_rate": learning_rate}
    write_json(folder / "run_card.json", {"spec": spec, "weights": weights(hidden)})


def paper_like(run, epochs=EPOCHS):
    """Write ablations that behave as the paper says."""
    best = dict(enumerate((0.3, 0.1, 0.08, 0.15, 0.14, 0.16, 0.17, 0.15, 0.09), start=1))
    speed = dict(enumerate((0.2, 0.5, 0.6, 0.3, 0.3, 0.3, 0.3, 0.3, 0.9), start=1))
    for number, hidden in enumerate(findings.SHAPES, start=1):
        seconds = 7.0 if number == 9 else 1 + weights(hidden) * 1e-7
        put(run / f"ablations/shapes/{number}", curve(best[number], speed[number], seconds, epochs), hidden)
    speeds, times = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.4, 0.6), (1, 1.2, 1.4, 1.5, 1.6, 1.65, 1.6, 1.7)
    for number, hidden in enumerate(findings.DEPTHS, start=1):
        losses = curve(0.1, speeds[number - 1], times[number - 1], epochs)
        put(run / f"ablations/depths/{number}", losses, hidden)
    for width, mse in ((300, 0.3), (600, 0.25)):
        for role in ("voluntary", "reflex"):
            put(run / f"ablations/core_widths/{role}_{width}", curve(mse, epochs=epochs), (width,) * 6)
    put(run / "ablations/learning_rates/1e-6", curve(0.8, 0.1, epochs=epochs), learning_rate=1e-6)
    put(run / "ablations/learning_rates/1e-3", curve(0.1, epochs=epochs), learning_rate=1e-3)


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "ABLATIONS", dict.fromkeys(findings.CHECKS, ""))
    paper_like(tmp_path / "run")
    return tmp_path / "run"


def judged(run, out) -> dict[str, str]:
    assert cli.run(findings.main, ["--run", str(run), "--out", str(out)]) == 0
    return {row["metric"]: judge(row)["status"] for row in read_json(out / "rows.json")}


def test_trainings_like_the_papers_pass(run, tmp_path):
    verdicts = judged(run, tmp_path)
    assert len(verdicts) == 25
    assert set(verdicts.values()) == {"pass", ""}


def test_every_table_of_the_registry_is_checked():
    assert set(registry.ABLATIONS) <= set(findings.CHECKS)


@pytest.mark.parametrize(
    ("table", "row", "losses", "metric", "verdict"),
    [
        ("shapes", 9, curve(0.09, 0.9, 30.0), "time an epoch, (9) over the mean of (1) to (8): at most", "miss"),
        ("shapes", 9, curve(0.09, 0.9, 5.5), "time an epoch, (9) over the mean of (1) to (8): at least", "near"),
        ("shapes", 3, curve(0.2, 0.6, 1.1), "(3) among the best: rank of its MSE, of 9", "miss"),
        ("shapes", 1, curve(0.1, 0.2, 1.0), "(1) converges less well: MSE over the worse of (2), (3)", "near"),
        ("shapes", 4, curve(0.1, -0.1, 1.0), "nets that converged, of 9", "near"),
        ("depths", 7, curve(0.1, 0.8, 1.6), "epochs to converge, depth 7 over 6", "miss"),
        ("depths", 8, curve(0.1, 0.6, 9.0), "time an epoch, longest over shortest of depths 6 to 8", "miss"),
        ("learning_rates", "1e-6", curve(0.05, 1.0), "1e-3 is Adam's step size: unexplained variance at 1e-3 over 1e-6",
         "miss"),
        ("core_widths", "voluntary_600", curve(0.4), "voluntary net, 600 does better: MSE over that of 300", "miss"),
    ],
)  # fmt: skip
def test_a_run_that_differs_does_not_pass(run, tmp_path, table, row, losses, metric, verdict):
    with open(run / f"ablations/{table}/{row}/loss.csv", "w", newline="") as file:
        csv.writer(file).writerows([list(losses), *zip(*losses.values(), strict=True)])
    assert judged(run, tmp_path)[metric] == verdict


@given(level=st.floats(0.11, 0.8), speed=st.floats(0.2, 2))
def test_epochs_to_a_level_are_interpolated(level, speed):
    trial = Trial("1", (300,), 1e-3, curve(0.1, speed), 1)
    exact = -math.log((level - 0.1) / 0.9) / speed
    found = trial.epochs_to(level)
    if exact >= EPOCHS:
        assert found == EPOCHS
    elif exact <= 1:
        assert found == 1
    else:
        assert math.floor(exact) <= found <= math.ceil(exact)


@given(st.lists(st.floats(0.01, 0.9), min_size=2, max_size=6))
def test_every_net_reaches_the_common_level(bests):
    trials = [Trial(str(i), (300,), 1e-3, curve(best, 1.0), 1) for i, best in enumerate(bests)]
    level = common_level(trials)
    assert all(trial.losses["validation_mse"].min() <= level for trial in trials)


def test_missing_and_broken_tables_are_named(run, tmp_path, capsys):
    with pytest.raises(UserError, match="ablations/none"):
        read_table(run, "none")
    (run / "ablations/shapes/3/loss.csv").write_text("epoch\nx\n")
    with pytest.raises(UserError, match="shapes/3/loss.csv"):
        read_table(run, "shapes")
    with pytest.raises(UserError, match="no such file"):
        read_losses(run / "none.csv")
    (run / "ablations/core_widths/reflex_300").rename(tmp_path / "moved")
    with pytest.raises(UserError, match="reflex_300"):
        findings.core_width_findings(read_table(run, "core_widths"))
    put(tmp_path / "few/ablations/shapes/1", curve(), (7, 7))
    assert cli.run(findings.main, ["--run", str(tmp_path / "few"), "--out", str(tmp_path)]) == 2
    assert "not trained: [100, 100" in capsys.readouterr().err


SCRIPTS = (
    "fig28_ablation_mse",
    "fig29_ablation_time",
    "learning_rates",
)


def draw(script: str, run, out) -> int:
    module = importlib.import_module(f"anthro.figures.nakada2018.{script}")
    return cli.run(lambda argv: module.command(module.draw, argv), ["--run", str(run), "--out", str(out)])


@pytest.mark.parametrize("script", SCRIPTS)
def test_figures_are_drawn_from_long_and_from_short_runs(script, tmp_path):
    for epochs in (30, 1):
        run = tmp_path / str(epochs)
        paper_like(run, epochs)
        assert draw(script, run, run / "figure.png") == 0
        assert (run / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("script", SCRIPTS)
def test_figures_of_an_empty_run_say_what_is_missing(script, tmp_path, capsys):
    assert draw(script, tmp_path, tmp_path / "figure.png") == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert not (tmp_path / "figure.png").exists()
