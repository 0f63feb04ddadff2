"""The benchmark of the eyes and the figures of their retinas: rows, files, bad input."""

import json

import numpy as np
import pytest
from PIL import Image

from anthro import scorecard
from anthro.eyes import benchmark
from anthro.figures.nakada2018 import fig14_sight, fig15_retina

FOUND = {
    "placed_frame_s": 0.002,
    "placed_frame_95_s": 0.006,
    "rebuilt_frame_s": 0.06,
    "placed_rays_per_s": 3.6e6,
    "rebuilt_rays_per_s": 1.2e5,
    "placed_over_rebuilt": 30.0,
}


@pytest.fixture(scope="module")
def run(tmp_path_factory, body_folder):
    """A run that has the seated body."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "body").mkdir()
    (folder / "body" / "nakada2018").symlink_to(body_folder("nakada2018"))
    return folder


def test_rows_are_judged():
    judged = {row["metric"]: scorecard.judge(row)["status"] for row in benchmark.rows_of(FOUND)}
    assert judged["placed_frame_s"] == judged["placed_over_rebuilt"] == "pass"
    assert judged["placed_frame_95_s"] != "pass" and judged["rebuilt_frame_s"] == ""


def test_both_ways_see_the_same_with_limbs_and_balls_in_view(run, load_body):
    world = benchmark.World.of(load_body("nakada2018"), 7)
    world.move(0, np.random.default_rng(0))
    assert min(world.in_view().values()) > 5
    apart = np.abs(world.eyes.see(world.data) - world.rebuilt()).reshape(2, -1, 3).max(axis=2)
    assert (apart > 0.05).mean() < 0.005  # facets of the balls' rims and highlights


def test_files_are_written(run, tmp_path, capsys):
    out = tmp_path / "eyes"
    assert benchmark.main(["--run", str(run), "--frames", "2", "--json", "--out", str(out)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["rays"] == 7200 and found["placed_rays_per_s"] > found["rebuilt_rays_per_s"]
    assert len(scorecard.collect([out / "rows.json"])) == len(benchmark.rows_of(FOUND))
    assert (out / "run_card.json").is_file() and (out / "metrics.json").is_file()


def test_bad_input_is_told(run, tmp_path, refusal):
    assert "nowhere" in refusal(benchmark.main, ["--run", tmp_path / "nowhere"])
    assert "--frames" in refusal(benchmark.main, ["--run", run, "--frames", "0"])
    assert "nowhere" in refusal(fig14_sight.main, ["--run", tmp_path / "nowhere", "--out", tmp_path / "a.png"])


@pytest.mark.parametrize("figure", [fig14_sight, fig15_retina])
def test_figures_are_drawn(run, tmp_path, figure):
    out = tmp_path / "figure.png"
    figure.main(["--run", str(run), "--out", str(out)])
    with Image.open(out) as drawn:
        assert min(drawn.size) > 600 and len(drawn.convert("RGB").getcolors(1 << 24)) > 10
