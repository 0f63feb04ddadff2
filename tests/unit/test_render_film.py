"""Rollouts read for drawing, captions, videos and the command lines that make them."""

import matplotlib

matplotlib.use("Agg")

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest
from PIL import Image

from anthro import cli
from anthro.errors import UserError
from anthro.figures.nakada2018 import fig21_arm_on_off, reach_error
from anthro.files import read_json, write_shard
from anthro.render import film
from anthro.render.caption import caption, strip_height
from anthro.render.rollout import load_body, read_rollout


def record(run, steps=120, **changes):
    time = np.arange(steps) * 0.1
    on = (time < 3) | (time >= 7)
    hand = np.zeros((steps, 3))
    hand[:, 2] = np.where(on, 1.4, 1.4 - np.clip(time - 3, 0, 0.5))
    hand[on & (time >= 7), 2] = 0.9 + np.clip(time[on & (time >= 7)] - 7, 0, 0.5)
    columns = {
        "time": time,
        "qpos": np.linspace(0, 1, steps)[:, None].repeat(7, axis=1),
        "activation": on[:, None] * np.full((steps, 29), 0.3),
        "hand": hand,
        "target": np.full((steps, 3), np.nan),
        "controller_on": on,
    }
    columns.update(changes)
    attrs = {"limb": "right_arm", "seed": 7, "step_seconds": 0.1}
    write_shard(run / "demos" / "on_off" / "rollout.h5", columns, attrs)


BODY = """
<mujoco>
  <asset>
    <mesh name="bone" vertex="-.02 -.02 0  .02 -.02 0  .02 .02 0  -.02 .02 0
                              -.02 -.02 .3  .02 -.02 .3  .02 .02 .3  -.02 .02 .3"/>
  </asset>
  <worldbody>
    <site name="origin" pos=".1 -.2 1.5"/>
    <body name="humerus" pos="0 -.2 1.4">
      <joint name="flexion" axis="0 -1 0"/>
      <geom type="mesh" mesh="bone" pos="0 0 -.3" mass="1"/>
      <site name="end" pos=".05 0 -.2"/>
      <site name="hand" pos="0 0 -.3"/>
    </body>
  </worldbody>
  <tendon><spatial name="m"><site site="origin"/><site site="end"/></spatial></tendon>
</mujoco>
"""


@pytest.fixture
def small_run(tmp_path):
    """A run with a body of one joint and one muscle, and its rollout."""
    folder = tmp_path / "body" / "right_arm"
    folder.mkdir(parents=True)
    model = mujoco.MjModel.from_xml_string(BODY)
    mujoco.mj_saveModel(model, str(folder / "model.mjb"))
    (folder / "joints.csv").write_text("joint,min,max,rest,stiffness,damping\nflexion,-1,2,0,0,1\n")
    (folder / "muscles.csv").write_text(
        "muscle,region,group,max_force,slack_length,tendon_length\nm,arm,shoulder,100,0.2,0.1\n"
    )
    (folder / "ligaments.csv").write_text("ligament,stiffness,damping,slack_low,slack_high\n")
    (folder / "contacts.csv").write_text("contact,radius,surfaces\n")
    record(
        tmp_path,
        qpos=np.linspace(0, 1, 120)[:, None],
        activation=np.full((120, 1), 0.5),
        target=np.full((120, 3), [0.3, -0.2, 1.3]),
    )
    return tmp_path


def test_film_of_a_run(small_run):
    request = ["--run", str(small_run), "--demo", "on_off", "--width", "96", "--height", "80"]
    assert cli.run(film.main, [*request, "--fps", "1", "--out", str(small_run / "a.mp4")]) == 0
    card = read_json(small_run / "a.run_card.json")
    assert card["frames"] == 12 and card["seed"] == 7
    stills = []
    for time in ("0", "11"):
        out = small_run / f"{time}.png"
        assert cli.run(film.main, [*request, "--at", time, "--out", str(out)]) == 0
        stills.append(np.asarray(Image.open(out)))
    assert stills[0].shape == (80, 96, 3) and not np.array_equal(*stills)
    assert cli.run(film.main, [*request, "--at", "99", "--out", str(small_run / "b.png")]) == 2


def test_body_that_does_not_fit_the_rollout_is_refused(small_run):
    record(small_run)
    with pytest.raises(UserError, match="1 degrees of freedom and 1 muscles, the rollout 7 and 29"):
        load_body(small_run, read_rollout(small_run, "on_off"))


def pictures(count=6, width=64, height=48):
    ramp = np.arange(width * 3).reshape(1, width, 3) % 256
    return [np.broadcast_to((ramp + 9 * i) % 256, (height, width, 3)).astype(np.uint8) for i in range(count)]


def test_rollout_at_other_times(tmp_path):
    record(tmp_path)
    rollout = read_rollout(tmp_path, "on_off")
    assert rollout.seed == 7 and np.allclose(rollout.switches(), [3, 7])
    now = rollout.at(np.array([0.05, 2.95, 3.05, 99.0]))
    assert now.qpos[0, 0] == pytest.approx(0.5 / 119)
    assert now.controller_on.tolist() == [True, True, False, True]


@pytest.mark.parametrize(
    "changes, word",
    [({"time": np.arange(5.0)}, "length"), ({"qpos": np.full((120, 7), np.nan)}, "qpos")],
)
def test_bad_rollouts_are_refused_by_name(tmp_path, changes, word):
    record(tmp_path, **changes)
    with pytest.raises(UserError, match=rf"rollout\.h5.*{word}"):
        read_rollout(tmp_path, "on_off")


def test_six_moments_in_order(tmp_path):
    record(tmp_path)
    rollout = read_rollout(tmp_path, "on_off")
    times = fig21_arm_on_off.moments(rollout)
    assert np.all(np.diff(times) > 0)
    assert rollout.at(times).controller_on.tolist() == [True, False, False, False, True, True]


def test_moments_need_the_controller_switched(tmp_path):
    record(tmp_path, controller_on=np.ones(120))
    with pytest.raises(UserError, match="not turned off"):
        fig21_arm_on_off.moments(read_rollout(tmp_path, "on_off"))


def test_caption_adds_a_strip_and_tells_on_from_off():
    height = strip_height(120)
    assert height % 2 == 0
    picture = np.zeros((120 - height, 160, 3), np.uint8)
    on, off = (caption(picture, 1.5, state, height) for state in (True, False))
    assert on.shape == (120, 160, 3) and not np.array_equal(on, off)


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
        columns[f"errors_{who}_no_reflex"] = columns[f"errors_{who}"] * 1.5
    write_shard(run / "demos" / demo / "rollout.h5", columns)


def test_reach_error_draws_whatever_controllers_it_finds(tmp_path):
    reach(tmp_path, "reach", "teacher", "paper")
    for name in ("a.png", "b.png"):
        reach_error.main(["--run", str(tmp_path), "--out", str(tmp_path / name)])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_reach_error_joins_the_demos_of_one_set_of_targets(tmp_path):
    reach(tmp_path, "reach_paper", "teacher", "paper")
    reach(tmp_path, "reach_proprioceptive", "teacher", "proprioceptive")
    assert list(reach_error.read(tmp_path)[2]) == ["teacher", "proprioceptive", "paper"]
    reach(tmp_path, "reach_paper", "paper", targets=9)
    with pytest.raises(UserError, match="reach_paper.*same targets"):
        reach_error.read(tmp_path)
    reach(tmp_path, "reach_paper")
    reach(tmp_path, "reach_proprioceptive")
    with pytest.raises(UserError, match="errors_<controller>"):
        reach_error.read(tmp_path)
