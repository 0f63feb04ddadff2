"""Rollouts read for drawing, captions, videos and the command lines that make them."""

import matplotlib

matplotlib.use("Agg")

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image
from render_bodies import record, write_body

from anthro import cli
from anthro.errors import UserError
from anthro.figures.nakada2018 import fig20_neck_on_off, fig21_arm_on_off, reach_error
from anthro.figures.on_off import moments
from anthro.figures.strip import GAP, strip
from anthro.files import read_json, write_shard
from anthro.render import film
from anthro.render.caption import caption, strip_height
from anthro.render.palette import legend
from anthro.render.rollout import read_rollout


@pytest.fixture
def run(tmp_path):
    """A run with a body of one joint and one muscle, and its rollout."""
    write_body(tmp_path)
    record(tmp_path)
    return tmp_path


def test_film_of_a_run(run):
    request = ["--run", str(run), "--demo", "on_off", "--width", "96", "--height", "80"]
    assert cli.run(film.main, [*request, "--fps", "1", "--out", str(run / "a.mp4")]) == 0
    card = read_json(run / "a.run_card.json")
    assert card["frames"] == 12 and card["seed"] == 7
    stills = []
    for time in ("0", "11"):
        out = run / f"{time}.png"
        assert cli.run(film.main, [*request, "--at", time, "--out", str(out)]) == 0
        stills.append(np.asarray(Image.open(out)))
    assert stills[0].shape == (80, 96, 3) and not np.array_equal(*stills)
    assert cli.run(film.main, [*request, "--at", "99", "--out", str(run / "b.png")]) == 2


def test_camera_stands_where_it_is_asked_to(run):
    request = ["--run", str(run), "--demo", "on_off", "--width", "96", "--height", "80"]
    for azimuth in ("10", "100"):
        assert cli.run(film.main, [*request, "--azimuth", azimuth, "--out", str(run / f"{azimuth}.png")]) == 0
    assert (run / "10.png").read_bytes() != (run / "100.png").read_bytes()


def pictures(count=6, width=64, height=48):
    ramp = np.arange(width * 3).reshape(1, width, 3) % 256
    return [np.broadcast_to((ramp + 9 * i) % 256, (height, width, 3)).astype(np.uint8) for i in range(count)]


def test_six_moments_in_order(run):
    rollout = read_rollout(run, "on_off")
    for series in (rollout.effector[:, 0, 2], -rollout.effector[:, 0, 2]):
        times = moments(rollout, series)
        assert np.all(np.diff(times) > 0)
        assert rollout.at(times).controller_on.tolist() == [True, False, False, False, True, True]


def test_moments_need_the_controller_switched(run):
    record(run, controller_on=np.ones(120))
    rollout = read_rollout(run, "on_off")
    with pytest.raises(UserError, match="not turned off"):
        moments(rollout, rollout.effector[:, 0, 2])


def test_a_strip_shows_its_frames_side_by_side_under_labels(run):
    image = strip(run, "on_off", [0.0, 4.0, 11.0], 60, 80)
    assert image.shape == (80, 3 * 60 + 2 * GAP, 3)
    cut = [image[:, left : left + 60] for left in (0, 60 + GAP, 120 + 2 * GAP)]
    assert (image[:, 60 : 60 + GAP] == 255).all()
    assert not np.array_equal(cut[0], cut[1]) and not np.array_equal(cut[1], cut[2])
    record(run, "reach", controller_on=np.ones(120))
    unswitched = strip(run, "reach", [0.0, 4.0, 11.0], 60, 80)
    assert np.array_equal(unswitched[7:], image[7:]) and not np.array_equal(unswitched[:7], image[:7])


def test_figures_of_arm_and_neck_turned_off_and_on(run):
    record(run, "neck_on_off", direction=np.zeros((120, 2)))
    time = np.arange(120) * 0.1
    droop = np.where((time >= 3) & (time < 7), np.clip(time - 3, 0, 1), np.clip(8 - time, 0, 1) * (time >= 7))
    record(run, "neck_on_off", limbs="neck_seated", direction=np.stack([0 * droop, droop], axis=1))
    for script in (fig20_neck_on_off, fig21_arm_on_off):
        out = run / f"{script.DEMO}.png"
        assert cli.run(script.main, ["--run", str(run), "--out", str(out)]) == 0
        assert Image.open(out).width == 2100


def test_neck_without_the_heads_direction_is_one_line(run, capsys):
    record(run, "neck_on_off")
    assert cli.run(fig20_neck_on_off.main, ["--run", str(run), "--out", str(run / "a.png")]) == 2
    assert "direction" in capsys.readouterr().err


def test_caption_adds_a_strip_and_tells_on_from_off():
    height = strip_height(120)
    assert height % 2 == 0
    picture = np.zeros((120 - height, 160, 3), np.uint8)
    on, off = (caption(picture, 1.5, state, height, {}) for state in (True, False))
    assert on.shape == (120, 160, 3) and not np.array_equal(on, off)


def test_caption_explains_colours_where_there_is_room():
    words = legend(["left_arm"])
    wide, narrow = np.zeros((350, 640, 3), np.uint8), np.zeros((350, 200, 3), np.uint8)
    strips = [caption(picture, 1.5, True, 34, words)[350:] for picture in (wide, narrow)]
    colourful = [(np.ptp(band.astype(int), axis=2) > 100).any() for band in strips]
    assert colourful == [True, False]


def test_video_is_reproducible_and_plays_everywhere(tmp_path):
    paths = [tmp_path / "a.mp4", tmp_path / "b.mp4"]
    for path in paths:
        film.write_video(path, iter(pictures()), (64, 48), 10)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    reader = imageio_ffmpeg.read_frames(str(paths[0]))
    meta = next(reader)
    reader.close()
    assert meta["codec"] == "h264" and meta["pix_fmt"].startswith("yuv420p")
    assert meta["size"] == (64, 48) and meta["fps"] == 10
    assert meta["duration"] == pytest.approx(0.6)


def test_failed_encoding_leaves_nothing(tmp_path):
    with pytest.raises(UserError, match="even"):
        film.write_video(tmp_path / "odd.mp4", pictures(width=63), (63, 48), 10)
    with pytest.raises(OSError, match="ffmpeg failed"):
        film.write_video(tmp_path / "none.mp4", [], (64, 48), 0)
    assert not list(tmp_path.iterdir())


def test_picture_is_written_as_png(tmp_path):
    film.write_picture(tmp_path / "a.png", pictures()[0])
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), pictures()[0])


@pytest.mark.parametrize(
    "main, extra",
    [
        (film.main, ["--demo", "on_off", "--out", "a.mp4"]),
        (fig20_neck_on_off.main, ["--out", "a.png"]),
        (fig21_arm_on_off.main, ["--out", "a.png"]),
        (reach_error.main, ["--out", "a.png"]),
    ],
)
def test_missing_rollout_is_one_line_and_exit_code_2(tmp_path, capsys, monkeypatch, main, extra):
    monkeypatch.chdir(tmp_path)
    assert cli.run(main, ["--run", "results/none", *extra]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "rollout.h5" in told
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "extra, word",
    [(["--out", "a.gif"], ".mp4"), (["--out", "a.mp4", "--width", "5"], "small")],
)
def test_film_refuses_what_it_cannot_make(tmp_path, capsys, extra, word):
    assert cli.run(film.main, ["--run", str(tmp_path), "--demo", "on_off", *extra]) == 2
    assert word in capsys.readouterr().err


def reach(run, demo, *whose, targets=8):
    random = np.random.default_rng(0)
    time = np.arange(0, 1.5, 0.05)
    columns = {"target_time": time, "targets": random.normal(0, 0.1, (targets, 3))}
    for who in whose:
        columns[f"errors_{who}"] = 0.3 * np.exp(-5 * time) + random.uniform(0, 0.05, (targets, 1))
        columns[f"success_{who}"] = columns[f"errors_{who}"][:, -1] < 0.03
        columns["errors_no_reflex"] = columns[f"errors_{who}"][:4] * 1.5
    write_shard(run / "demos" / demo / "rollout.h5", columns)


def test_reach_error_draws_whatever_controllers_it_finds(tmp_path):
    reach(tmp_path, "reach_right_arm_paper", "teacher", "paper")
    for name in ("a.png", "b.png"):
        reach_error.main(["--run", str(tmp_path), "--out", str(tmp_path / name)])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_reach_error_joins_the_demos_of_one_set_of_targets(tmp_path):
    reach(tmp_path, "reach_right_arm_paper", "teacher", "paper")
    reach(tmp_path, "reach_right_arm_proprioceptive", "teacher", "proprioceptive")
    assert list(reach_error.read(tmp_path)[2]) == ["teacher", "proprioceptive", "paper"]
    reach(tmp_path, "reach_right_arm_paper", "paper", targets=9)
    with pytest.raises(UserError, match="reach_right_arm_paper.*same targets"):
        reach_error.read(tmp_path)
    reach(tmp_path, "reach_right_arm_paper")
    reach(tmp_path, "reach_right_arm_proprioceptive")
    with pytest.raises(UserError, match="errors_<controller>"):
        reach_error.read(tmp_path)
