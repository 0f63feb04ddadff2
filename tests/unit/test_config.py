"""Settings are merged and checked; what is wrong is named by file, key and value."""

import itertools
import shutil
from pathlib import Path

import pytest
import yaml

from anthro import cli, config, registry
from anthro.body.parts import BODIES
from anthro.errors import UserError

ROOT = Path(__file__).resolve().parents[2]
DEMOS = registry.DEMOS.values()
BLOCK = 80  # validation_block of the nets


@pytest.fixture
def root(tmp_path):
    for part in ("config", "workflow"):
        shutil.copytree(ROOT / part, tmp_path / part)
    return tmp_path


def scales():
    return sorted(path.stem for path in (ROOT / "config" / "scales").glob("*.yaml"))


def test_the_run_is_named_after_its_scale_unless_told():
    assert config.load({"scale": "smoke"}, ROOT)["run"] == "smoke"
    assert config.load({"scale": "smoke", "run": "mine"}, ROOT)["run"] == "mine"


@pytest.mark.parametrize("scale", scales())
def test_every_scale_is_whole(scale):
    settings = config.load({"scale": scale}, ROOT)
    assert settings["sizes"]["limbs"].keys() == {limb["region"] for limb in settings["limbs"].values()}
    assert settings["sizes"]["ablation"].keys() == registry.ABLATIONS.keys()
    assert settings["sizes"]["demos"].keys() <= {*(demo.module.rpartition(".")[2] for demo in DEMOS), "solvers"}
    for net in settings["nets"]:
        assert config.net_spec(settings, net)["epochs"] >= 1
    for sizes in settings["sizes"]["limbs"].values():
        assert all(sizes[role]["pairs"] >= 2 * BLOCK for role in ("voluntary", "reflex")), "too few to be split"


def test_paper_scale_has_the_papers_sizes():
    settings = config.load({"scale": "paper"}, ROOT)
    sizes, numbers = settings["sizes"], settings["papers"]["nakada2018"]["numbers"]
    pairs = numbers["voluntary_pairs"]["value"]
    for limb in sizes["limbs"].values():
        assert limb["rounds"] * limb["voluntary"]["shards"] * limb["voluntary"]["pairs"] == pairs
        assert limb["reflex"]["shards"] * limb["reflex"]["pairs"] == pairs
        assert limb["epochs"] == {"voluntary": 2000, "reflex": 2000}


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        (
            "config/loop.yaml",
            "sight_steps:",
            "site_steps:",
            "config/loop.yaml: site_steps: 2: unknown key; did you mean 'sight_steps'?",
        ),
        (
            "config/loop.yaml",
            "jump_deg: 3.0",
            "jump_deg: 0",
            "config/loop.yaml: gaze.jump_deg: 0 is less than or equal",
        ),
        ("config/config.yaml", "seed: 7", "sead: 7", "config/config.yaml: sead: 7: unknown key; did you mean 'seed'?"),
        ("config/config.yaml", "seed: 7", "seed: -7", "config/config.yaml: seed: -7 is less than"),
        ("config/scales/smoke.yaml", "fps: 1", "fps: fast", "config/scales/smoke.yaml: film.fps: 'fast' is not"),
        ("config/scales/smoke.yaml", "fps: 1", "", "config/scales/smoke.yaml: film: 'fps' is a required"),
        (
            "config/nets/nakada2018/right_arm_reflex.yaml",
            "batch_size:",
            "batchsize:",
            "config/nets/nakada2018/right_arm_reflex.yaml: batchsize: 256: unknown key; did you mean 'batch_size'?",
        ),
        ("config/data/right_arm_reflex.yaml", "push_force:", "force:", "right_arm_reflex.yaml: rollout.force: 10.0:"),
        ("config/limbs/core.yaml", "lack:", "lacks:", "config/limbs/core.yaml: lacks: 3.0: unknown key; did you mean"),
        ("config/limbs/core.yaml", "senses: orientation", "senses: taste", "core.yaml: senses: 'taste' is not one of"),
        ("config/config.yaml", "mirrored #", "copied #", "config/config.yaml: left_limbs: 'copied' is not one of"),
        (
            "config/ablations/core_widths.tsv",
            "core_reflex",
            "tail",
            "row reflex_300: net: 'tail' is not in config/nets/",
        ),
        ("config/ablations/depths.tsv", "1800", "many", "config/ablations/depths.tsv: row 1: hidden: 'many' is not"),
        ("config/ablations/shapes.tsv", "hidden", "hiden", "config/ablations/shapes.tsv: row 1: hiden:"),
        ("config/papers/nakada2018.yaml", "label: Fig. 13", "lable: Fig. 13", "figures.fig13_reflex_training.lable"),
        ("config/config.yaml", "seed: 7", "seed: [", "config/config.yaml: not readable as YAML"),
    ],
)
def test_what_is_wrong_is_named_in_one_line(root, capsys, monkeypatch, name, old, new, told):
    path = root / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    monkeypatch.chdir(root)
    assert cli.run(config.main, ["--check", "scale=smoke"]) == 2
    error = capsys.readouterr().err
    assert told in error and error.count("\n") == 1


@pytest.mark.parametrize("override", ["sead=1", "seed=one", "scale=tiny", "seed", "run=a/b", "papers=[lee2006]"])
def test_wrong_overrides_are_refused(capsys, monkeypatch, override):
    monkeypatch.chdir(ROOT)
    assert cli.run(config.main, ["--check", override]) == 2
    assert override.partition("=")[2].strip("[]") in capsys.readouterr().err


def test_print_shows_the_merged_settings(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    assert cli.run(config.main, ["--print", "scale=smoke", "seed=3"]) == 0
    shown = yaml.safe_load(capsys.readouterr().out)
    assert shown == config.load({"scale": "smoke", "seed": 3}, ROOT)


def test_specs_hold_what_decides_a_job_and_no_more():
    settings = config.load({"scale": "smoke", "seed": 3}, ROOT)
    data = config.data_spec(settings, "right_arm_reflex")
    assert data.keys() == {"teacher", "rollout", "limb", "pairs", "seed"}
    arm = settings["sizes"]["limbs"]["arm"]
    assert data["limb"] == {"name": "right_arm"} | settings["limbs"]["right_arm"]
    assert data["pairs"] == arm["reflex"]["pairs"]
    net = config.net_spec(settings, "right_arm_reflex")
    assert net["epochs"] == arm["epochs"]["reflex"] and net["samples"] is None
    row = config.ablation_spec(settings, "shapes", "9")
    assert row["hidden"] == [3000, 3000] and row["samples"] == settings["sizes"]["ablation"]["shapes"]["samples"]
    assert row["inputs"] == ["offset", "drive"]
    assert (row["schedule"], row["start"], row["softening"]) == ("constant", "he", {})
    assert config.ablation_spec(settings, "learning_rates", "1e-6")["learning_rate"] == 1e-6
    narrow = config.ablation_spec(settings, "core_widths", "reflex_300")
    assert narrow["hidden"] == [300] * 6 and narrow["dataset"] == "core_reflex" and "net" not in narrow
    assert narrow["name"] == "core_reflex_core_widths_reflex_300"


def test_spec_is_written_as_sorted_json(tmp_path, capsys):
    path = tmp_path / "spec.json"
    assert cli.run(config.main, ["--write", str(path), "--spec", '{"b": 1, "a": 2}']) == 0
    assert path.read_text() == '{\n "a": 2,\n "b": 1\n}\n'
    assert cli.run(config.main, ["--write", str(path), "--spec", "{"]) == 2


def test_registry_and_yaml_files_agree():
    settings = config.load({"scale": "smoke"}, ROOT)
    assert settings["nets"].keys() == registry.NETS.keys()
    assert settings["limbs"].keys() == registry.LIMBS.keys()
    assert {limb["body"] for limb in settings["limbs"].values()} | {
        body for demo in DEMOS for body in demo.bodies
    } <= BODIES.keys()
    for name, net in registry.NETS.items():
        assert settings["nets"][name]["name"] == name
        assert settings["nets"][name]["paper"] == net.paper
        eyes = registry.UNIFORM if name.startswith(registry.UNIFORM) else ""
        assert settings["nets"][name]["dataset"] == f"{eyes}{net.limb or 'eyes'}_{net.role}"
    assert settings["data"].keys() == {content["dataset"] for content in settings["nets"].values()}
    assert settings["ablations"].keys() == registry.ABLATIONS.keys()
    for paper, content in settings["papers"].items():
        ours = {name for name, figure in registry.FIGURES.items() if figure.paper == paper}
        assert content["figures"].keys() == ours
    captions = {path.stem for path in (ROOT / "workflow" / "report").glob("*.rst")}
    assert captions == registry.FIGURES.keys() | {"scorecard", "inventory"}


def test_limbs_name_nets_and_unknown_limbs_are_refused():
    for name, limb in registry.LIMBS.items():
        assert registry.limb(name) is limb
        assert set(limb.nets.values()) <= registry.NETS.keys()
    with pytest.raises(UserError, match="left_tail"):
        registry.limb("left_tail")


def test_there_are_three_nets_a_limb_and_left_ones_are_mirrored_or_trained():
    motor = [name for name, net in registry.NETS.items() if net.role not in config.SIGHT]
    assert len(motor) == 3 * len(registry.LIMBS) == 21
    mirrored = registry.mirrored_nets("mirrored")
    assert set(mirrored) == {name for name in motor if name.startswith("left_")}
    assert all(source == name.replace("left", "right") for name, source in mirrored.items())
    assert registry.mirrored_nets("trained") == {}
    settings = config.load({"scale": "smoke"}, ROOT)
    alike = {"name", "dataset"}
    for name, source in mirrored.items():
        ours, theirs = settings["nets"][name], settings["nets"][source]
        assert {key for key in ours if ours[key] != theirs[key]} == alike


def test_appendix_a_has_nine_shapes_and_eight_depths_of_about_1800_units():
    tables = config.load({"scale": "smoke"}, ROOT)["ablations"]
    assert len(tables["shapes"]) == 9 and len(tables["depths"]) == 8
    assert all(abs(sum(row["hidden"]) - 1800) <= 1 for row in tables["depths"].values())


def test_ten_vision_nets_meet_the_papers_weights_and_eyes_without_a_fovea_are_beside_them():
    settings = config.load({"scale": "smoke"}, ROOT)
    seeing = {name: net for name, net in registry.NETS.items() if net.role in config.SIGHT}
    assert len([name for name in seeing if not name.startswith(registry.UNIFORM)]) == 10
    for name, net in seeing.items():
        content = settings["nets"][name]
        sizes = [10800, *content["hidden"], 2 if net.role == "foveation" else 3]
        weights = sum(a * b for a, b in itertools.pairwise(sizes))
        assert weights == pytest.approx({"foveation": 11.5e6, "vision": 24.2e6}[net.role], rel=0.01)
        side = content["receptive_fields"]["side"]
        assert content["inputs"] == [side] and name.endswith(side)
        data = config.data_spec(settings, content["dataset"])
        assert data["retina"] == content["receptive_fields"]["retina"]
        assert data["limbs"].keys() == set(registry.SEATED) and data.get("limb", "") == net.limb
