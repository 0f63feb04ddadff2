"""The figures of training progress."""

import csv
import importlib

import numpy as np
import pytest

from anthro import cli
from anthro.errors import UserError
from anthro.figures.training import read_curve, voluntary_curves
from anthro.files import write_shard

COLUMNS = ("epoch", "train_mse", "validation_mse", "unexplained_variance", "learning_rate", "seconds")
TRAINED = [
    f"{limb}_voluntary_{inputs}"
    for limb in ("right_arm", "right_leg", "left_leg", "neck_seated", "core")
    for inputs in ("paper", "proprioceptive")
]
FIGURES = {
    "fig10_neck_training": "nakada2018",
    "fig11_voluntary_training": "nakada2018",
    "fig13_reflex_training": "nakada2018",
    "fig05_core_training": "zhou2021",
    "fig15_width_ablation": "zhou2021",
}


def put_losses(folder, epochs, start=1.0, floor=0.2, best=None) -> None:
    epoch = np.arange(1, epochs + 1)
    mse = floor + (start - floor) * np.exp(-0.4 * epoch)
    if best is not None:
        mse[best] = floor / 2
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "loss.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(zip(epoch, 0.8 * mse, mse, 1.3 * mse, 0 * epoch + 1e-3, 0 * epoch + 1.0, strict=True))


def put_run(run, epochs=10, rounds=4):
    """Write a run whose left arm is mirrored and whose left leg is trained."""
    for number, net in enumerate(TRAINED):
        ours = rounds if "voluntary" in net else 1
        for k in range(ours):
            put_losses(run / f"nets/{net}/round{k}", epochs, 0.5, 0.15 + 0.1 * (number % 2 == 0) - 0.02 * k)
    for net in ("core_reflex", "right_leg_reflex"):
        put_losses(run / f"nets/{net}/round0", 3 * epochs, 0.9, 0.05)
    for role, floor in (("voluntary", 0.3), ("reflex", 0.1)):
        for width in (300, 600):
            put_losses(
                run / f"ablations/core_widths/{role}_{width}", 2 * epochs, 1.0, floor * (1 + 0.2 * (width < 600))
            )
    for inputs in ("paper", "proprioceptive"):
        path = run / f"nets/left_arm_voluntary_{inputs}/weights.h5"
        write_shard(path, {}, {"mirrored_from": f"right_arm_voluntary_{inputs}"})
    return run


def draw(script: str, run, out) -> int:
    module = importlib.import_module(f"anthro.figures.{FIGURES[script]}.{script}")
    return cli.run(lambda argv: module.command(module.draw, argv), ["--run", str(run), "--out", str(out)])


@pytest.mark.parametrize("script", FIGURES)
def test_figures_are_drawn_from_long_and_from_short_runs(script, tmp_path):
    for epochs in (10, 1):
        run = put_run(tmp_path / str(epochs), epochs)
        assert draw(script, run, run / "figure.png") == 0
        assert (run / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("script", FIGURES)
def test_figures_of_an_empty_run_say_what_is_missing(script, tmp_path, capsys):
    assert draw(script, tmp_path, tmp_path / "figure.png") == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert not (tmp_path / "figure.png").exists()


def test_a_mirrored_net_shows_its_twins_training(tmp_path):
    run = put_run(tmp_path)
    left, right = (voluntary_curves(run, limb) for limb in ("left_arm", "right_arm"))
    assert [curve.mirrored_from for curve in left] == [
        "right_arm_voluntary_paper",
        "right_arm_voluntary_proprioceptive",
    ]
    assert [curve.mirrored_from for curve in right] == ["", ""]
    for ours, twin in zip(left, right, strict=True):
        assert (ours.epochs, ours.unexplained) == (twin.epochs, twin.unexplained)
    assert read_curve(run, "left_leg_voluntary_paper", "").mirrored_from == ""


def test_a_net_that_is_neither_trained_nor_mirrored_is_named(tmp_path):
    write_shard(tmp_path / "nets/left_leg_reflex/weights.h5", {}, {"name": "left_leg_reflex"})
    with pytest.raises(UserError, match="left_leg_reflex"):
        read_curve(tmp_path, "left_leg_reflex", "")


def test_numbers_are_those_of_the_weights_kept(tmp_path):
    for number, best in enumerate((None, 3)):
        put_losses(tmp_path / f"nets/core_reflex/round{number}", 10, best=best)
    curve = read_curve(tmp_path, "core_reflex", "")
    assert curve.epochs == 20
    assert curve.unexplained == pytest.approx(1.3 * 0.1)
