"""Figures of the closed loop and of the vision DNNs: what they read, which instants they choose, and that they draw."""

import csv
import importlib

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image
from render_bodies import INSTANTS, record, write_body

from anthro import cli, figures
from anthro.errors import UserError
from anthro.eyes.eye import SIDES, Eye
from anthro.figures import gaze, sequence
from anthro.figures.nakada2018 import fig17_foveation, sight_ablations, vision_error
from anthro.files import write_json, write_shard
from anthro.motor.network import FeedForward
from anthro.render.rollout import read_rollout

HEAD = np.array([0.0, 0.0, 1.3])  # of the toy body, which stands upright
LIMBS = ("right_arm", "left_arm", "right_leg", "left_leg")
NETS = ("foveation", *(f"{limb}_vision" for limb in LIMBS))
TRIALS = np.repeat([0, 1], INSTANTS // 2)
OF_DEMOS = {
    "fig17_foveation": "perception",
    "fig18_limb_sight": "perception",
    "fig22_perception": "perception",
    "fig23_cannon": "cannon",
    "fig25_bouncing": "bouncing",
}
OF_NETS = ("fig16_vision_training", "saliency", "vision_error")


def put_rollout(run, demo, **changes):
    """Two trials in each of which the eyes turn to a ball that stays, and the arm comes to it."""
    ball = HEAD + [0.5, 0.2, -0.1]
    share = np.clip(np.arange(INSTANTS) % (INSTANTS // 2) / 20, 0, 1)
    goal = np.array([Eye(side).angles_to(ball - HEAD) for side in SIDES])
    effector = ball + (1.02 - share)[:, None, None] * [[-0.3, 0.1, -0.4]]
    columns = {
        "trial": TRIALS,
        "ball": np.tile(ball, (INSTANTS, 1, 1)),
        "eyes": share[:, None, None] * goal,
        "nerve": np.full((INSTANTS, 2, 10800), 90, np.uint8),
        "qpos": np.zeros((INSTANTS, 3)),
        "controller_on": np.ones(INSTANTS, np.uint8),
        "effector": effector,
    }
    attrs = {"ball_radius": 0.05, "ball_colour": "#D02020", "retina": "log_polar"}
    record(run, demo, attrs=attrs, **columns | changes)


def put_nets(run):
    """Small nets, pairs, losses and errors."""
    rng = np.random.default_rng(0)
    for net in NETS:
        dataset = "eyes_foveation" if net == "foveation" else net
        write_shard(run / f"data/{dataset}/shard0000.h5", dict.fromkeys(SIDES, np.full((9, 10800), 90, np.uint8)))
        for side in SIDES:
            n_out = 2 if net == "foveation" else 3
            weights = [rng.normal(0, 0.1, shape) for shape in ((8, 10800), (n_out, 8))]
            folder = run / "nets" / f"{net}_{side}"
            FeedForward(weights, [np.ones(8), np.zeros(n_out)]).save(folder / "weights.h5")
            (folder / "round0").mkdir()
            with open(folder / "round0/loss.csv", "w", newline="") as file:
                names = ("epoch", "train_mse", "validation_mse", "unexplained_variance", "seconds")
                csv.writer(file).writerows([names, (1, 0.5, 0.6, 0.7, 1.0), (2, 0.3, 0.4, 0.5, 1.0)])
    write_json(run / "specs/data/eyes_foveation.json", {"retina": "log_polar", "seed": 7})
    columns = {f"foveation_{side}_error": rng.uniform(0.001, 0.05, 400) for side in SIDES}
    columns |= {f"foveation_{side}_direction": rng.uniform(-0.7, 0.7, (400, 2)) for side in SIDES}
    for limb in LIMBS:
        for name in ("vision_mean_error", "distance", "eccentricity"):
            columns[f"{limb}_{name}"] = rng.uniform(0.01, 0.8, 60)
    write_shard(run / "nets/vision/errors.h5", columns)


def draw(script, run, out):
    module = importlib.import_module(f"anthro.figures.nakada2018.{script}")
    return cli.run(lambda argv: figures.command(module.draw, argv), ["--run", str(run), "--out", str(out)])


@pytest.fixture
def run(tmp_path):
    write_body(tmp_path)
    yield tmp_path
    plt.close("all")


@pytest.mark.parametrize("script", OF_DEMOS)
def test_figures_of_the_loop_are_drawn_the_same_every_time(script, run, monkeypatch):
    monkeypatch.setattr(sequence, "WIDTH", 300)
    put_rollout(run, OF_DEMOS[script])
    for name in ("a.png", "b.png"):
        assert draw(script, run, run / name) == 0
    assert (run / "a.png").read_bytes() == (run / "b.png").read_bytes()
    assert len(Image.open(run / "a.png").getcolors(256)) > 20


@pytest.mark.parametrize("script", OF_DEMOS)
def test_eyes_that_never_find_the_ball_and_a_ball_that_is_lost_are_drawn_too(script, run, monkeypatch):
    monkeypatch.setattr(sequence, "WIDTH", 300)
    ball = np.tile(HEAD + [0.5, 0.2, -0.1], (INSTANTS, 1, 1))
    ball[30:60] = np.nan
    put_rollout(run, OF_DEMOS[script], eyes=np.zeros((INSTANTS, 2, 2)), ball=ball)
    assert draw(script, run, run / "a.png") == 0


@pytest.mark.parametrize("script", [*OF_DEMOS, *OF_NETS, "sight_ablations"])
def test_what_is_missing_is_told_in_one_line(script, run, capsys):
    assert draw(script, run, run / "a.png") == 2
    assert capsys.readouterr().err.count("\n") == 1
    if script in OF_DEMOS:
        for missing in gaze.COLUMNS:
            put_rollout(run, OF_DEMOS[script], **{missing: None})
            assert draw(script, run, run / "a.png") == 2
            assert missing in capsys.readouterr().err


@pytest.mark.parametrize("script", OF_NETS)
def test_figures_of_the_vision_nets_are_drawn(script, run):
    put_nets(run)
    assert draw(script, run, run / "a.png") == 0
    assert (run / "a.png").read_bytes().startswith(b"\x89PNG")


def test_gaze_is_measured_from_each_eyes_centre(run):
    put_rollout(run, "perception")
    rollout = read_rollout(run, "perception")
    error = gaze.gaze_error(rollout)
    ball = HEAD + [0.5, 0.2, -0.1]
    for side, name in enumerate(SIDES):
        way = ball - HEAD - Eye(name).centre
        assert error[0, side] == pytest.approx(np.arccos(way[0] / np.linalg.norm(way)), abs=1e-6)
    assert error[30].max() < 1e-6
    assert [len(trial) for trial in gaze.trials(rollout)] == [60, 60]
    limb, apart = gaze.reaching(rollout, gaze.trials(rollout)[1])
    assert limb == 0 and apart.min() == pytest.approx(0.02 * np.linalg.norm([0.3, 0.1, 0.4]))


def test_a_trial_without_a_ball_and_another_retina_are_named(run):
    put_rollout(run, "perception", ball=np.full((INSTANTS, 1, 3), np.nan))
    rollout = gaze.read(run, "perception")
    with pytest.raises(UserError, match="trial 1: there is no ball"):
        gaze.reaching(rollout, gaze.trials(rollout)[1])
    put_rollout(run, "perception", nerve=np.zeros((INSTANTS, 2, 9), np.uint8))
    with pytest.raises(UserError, match="9 numbers, but retina log_polar tells 10800"):
        gaze.retinas(gaze.read(run, "perception"))


def test_an_approach_is_told_by_what_is_left_of_it():
    distance = np.array([np.inf, 1.1, 0.9, 0.5, 0.1, 0.7])
    assert gaze.approach(distance, (1.0, 0.5, 0.0)).tolist() == [1, 3, 4]


def test_instants_of_a_saccade():
    time, error = 0.1 * np.arange(8), np.deg2rad([40, 40, 20, 0.5, 0.4, 0.3, 0.2, 0.2])
    assert fig17_foveation.instants(error, time).tolist() == [0, 2, 3, 7]
    never = np.deg2rad([np.nan, 30, 25, 22, 23, 24, 25, 26])
    assert fig17_foveation.instants(never, time).tolist() == [1, 3, 3, 7]
    with pytest.raises(UserError, match="no ball"):
        fig17_foveation.instants(np.full(8, np.nan), time)


def test_cells_of_the_field_hold_medians_where_there_are_pictures_enough():
    direction = np.array([[36.5, -38.0]] * 5 + [[0.1, 0.1]] * 2 + [[60.0, 0.0]] * 9)
    error = np.arange(16.0)
    found = vision_error.cells(direction, error)
    assert found.shape == (8, 8) and found[0, 7] == 2.0
    assert np.isfinite(found).sum() == 1


def test_a_field_of_too_few_pictures_is_an_empty_map():
    figure, axes = plt.subplots()
    vision_error.field(axes, np.array([[1.0, 2.0], [-30.0, 5.0]]), np.array([0.4, 0.9]))
    assert not np.isfinite(axes.images[0].get_array().filled(np.nan)).any()
    assert axes.images[0].get_clim() == (0.4, 0.9)
    figure.canvas.draw()
    plt.close(figure)


def test_ablations_are_bars_and_name_what_is_missing(run, capsys):
    for place, demo in enumerate(sight_ablations.DEMOS):
        metrics = {"targets": 40, "foveated": 1 - 0.1 * place, "reached": 0.8 - 0.1 * place}
        write_json(run / f"demos/{demo}/metrics.json", metrics | {"still_foveated": 0.9} if place else metrics)
    assert draw("sight_ablations", run, run / "a.png") == 0
    write_json(run / "demos/perception_one_eye/metrics.json", {"targets": 40, "foveated": 1})
    assert draw("sight_ablations", run, run / "a.png") == 2
    assert "perception_one_eye/metrics.json: no reached" in capsys.readouterr().err
    assert 0 < sight_ablations.standard_error(1.0, 40) < sight_ablations.standard_error(0.5, 40) < 0.08
