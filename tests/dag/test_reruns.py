"""What an edit reruns, and what it does not."""

from contextlib import contextmanager
from pathlib import Path

from anthro import config, registry

ROOT = Path(__file__).resolve().parents[2]
SMOKE = config.load({"scale": "smoke"}, ROOT)
ROWS = sum(map(len, SMOKE["ablations"].values()))
MIRRORED = registry.mirrored_nets(SMOKE["left_limbs"])
TRAININGS = sum(
    config.sizes_of(SMOKE, f"{net.limb}_{net.role}")["rounds"] if net.role == "voluntary" else 1
    for name, net in registry.NETS.items()
    if name not in MIRRORED
)


@contextmanager
def edited(place, name, change):
    path = place.folder / name
    before = path.read_text()
    path.write_text(change(before))
    try:
        yield
    finally:
        path.write_text(before)


def comment(text):
    return text + "\n# edited\n"


def test_a_finished_run_has_nothing_to_do(finished):
    assert finished.left_to_do() == {}


def test_editing_one_figure_script_redraws_that_figure_only(finished):
    with edited(finished, "src/anthro/figures/nakada2018/fig29_ablation_time.py", comment):
        assert finished.left_to_do() == {"figure_fig29_ablation_time": 1}


def test_editing_the_look_redraws_the_plots_only(finished):
    with edited(finished, "src/anthro/figures/house.mplstyle", comment):
        plots = {f"figure_{name}": 1 for name, figure in registry.FIGURES.items() if figure.suffix == "png"}
        assert finished.left_to_do() == plots


def test_editing_the_training_loop_makes_no_body_anew(finished):
    with edited(finished, "src/anthro/learn/train.py", comment):
        jobs = finished.left_to_do()
        assert jobs["train"] == TRAININGS and jobs["ablate"] == ROWS
        assert not {"body", "reflex_shard", "spec"} & jobs.keys()


def test_editing_the_plumbing_another_scale_or_a_comment_reruns_nothing(finished):
    names = ("src/anthro/progress.py", "config/scales/laptop.yaml", "config/scales/smoke.yaml", "config/config.yaml")
    for name in names:
        with edited(finished, name, comment):
            assert finished.left_to_do() == {}, name


def test_a_size_reruns_what_depends_on_it(finished):
    with edited(finished, "config/scales/smoke.yaml", lambda text: text.replace("fps: ", "fps: 1")):
        videos = {f"figure_{name}": 1 for name, figure in registry.FIGURES.items() if figure.suffix == "mp4"}
        assert finished.left_to_do() == videos
    with edited(finished, "config/scales/smoke.yaml", lambda text: text.replace("{samples: ", "{samples: 1")):
        jobs = finished.left_to_do()
        assert jobs["ablate"] == jobs["spec"] == ROWS
        assert not {"train", "voluntary_shard", "demo"} & jobs.keys()


def test_after_a_kill_only_what_is_missing_is_made(finished):
    """Killed in the middle of round 1's synthesis: round 0, the reflex, and what eyes and plants made stay."""
    done = ("/body/", "/specs/", "/round0/", "_reflex/shard", "foveation", "_vision", "/neuroanimator/")
    lost = [name for name in finished.outputs() if not any(part in name for part in done)]
    kept = {name: (finished.folder / name).read_text() for name in lost}
    for name in lost:
        (finished.folder / name).unlink()
    try:
        jobs = finished.left_to_do()
        assert jobs["voluntary_shard"] == 1 and jobs["train"] == 2
        assert not {"body", "reflex_shard", "spec"} & jobs.keys()
    finally:
        for name, content in kept.items():
            (finished.folder / name).write_text(content)
        finished.snakemake("--touch", "--forceall", "--quiet")
