"""Everything in the registry is in the DAG, at every scale, and bad settings stop it."""

import pytest

from anthro import config, registry


@pytest.fixture(scope="module")
def planned(finished):
    return finished.outputs()


def final_rule(net):
    """The rule that makes a trained net's weights: one that tries the rounds, if it moves a limb."""
    return "select" if registry.NETS[net].role == "voluntary" else "final_net"


def test_every_limb_net_demo_figure_and_ablation_is_made(planned):
    run = "results/smoke"
    settings = config.load({"scale": "smoke"})
    mirrored = registry.mirrored_nets(settings["left_limbs"])
    trained = registry.NETS.keys() - mirrored
    limbs = {registry.NETS[net].limb for net in trained if registry.NETS[net].role not in config.SIGHT}
    bodies = {settings["limbs"][limb]["body"] for limb in limbs} | {config.SEES}
    bodies |= {body for demo in registry.DEMOS.values() for body in demo.bodies} | {"zhou2021"}
    wanted = {f"{run}/body/{body}/model.mjb": "body" for body in bodies}
    wanted |= {f"{run}/nets/{net}/weights.h5": final_rule(net) for net in trained}
    wanted |= {f"{run}/nets/{net}/weights.h5": "mirror" for net in mirrored}
    wanted |= {f"{run}/nets/{net}/round0/loss.csv": "train" for net in trained}
    for table in registry.ABLATIONS:
        rows = settings["ablations"][table]
        wanted |= {f"{run}/ablations/{table}/{row}/loss.csv": "ablate" for row in rows}
    assert {name: planned.get(name) for name in wanted} == wanted
    for demo in registry.DEMOS:
        assert f"{run}/demos/{demo}/rows.json" in planned
    for figure in registry.FIGURES:
        assert f"figure_{figure}" in planned.values()
    assert planned[f"{run}/scorecard.csv"] == "scorecard" and planned[f"{run}/cost.csv"] == "cost"
    part = f"{run}/neuroanimator"
    wanted = {f"{part}/nets/{name}/weights.h5": "train_emulator" for name in registry.EMULATORS}
    wanted |= {f"{part}/pairs/{name}/operators.h5": "present" for name in registry.EMULATORS}
    wanted |= {f"{part}/data/{plant}_n{n}.h5": "sample" for plant, steps in registry.PLANTS.items() for n in steps}
    wanted |= {f"{part}/accuracy/{plant}/rows.json": "accuracy" for plant in registry.PLANTS}
    wanted |= {f"{part}/{stage}/{task}/rows.json": stage for stage in ("control", "search") for task in registry.TASKS}
    wanted |= {f"{part}/timing/table2/rows.json": "table2", f"{part}/scorecard.csv": "neuroanimator_scorecard"}
    assert {name: planned.get(name) for name in wanted} == wanted
    made = {name for name, rule in planned.items() if rule == "body" and name.endswith("model.mjb")}
    assert made == {f"{run}/body/{body}/model.mjb" for body in bodies}


def test_the_neuroanimator_stands_alone(workplace):
    told = workplace.snakemake("neuroanimator", "--dry-run", "--quiet", "rules").stdout
    rules = {line.split()[0] for line in told.splitlines() if len(line.split()) == 2 and line.split()[1].isdigit()}
    alone = {"accuracy", "control", "neuroanimator", "neuroanimator_scorecard", "present", "sample", "search", "spec"}
    alone |= {"table2", "train_emulator", "total"}
    assert alone <= rules
    assert all(rule.startswith("figure_") for rule in rules - alone), rules


def test_mirrored_limbs_have_neither_data_nor_training(planned):
    names = [net for limb in registry.LIMBS.values() if limb.mirror_of for net in limb.nets.values()]
    left = [name for name in planned if any(f"/nets/{net}/" in name for net in names)]
    assert len(left) == len(names) and all(planned[name] == "mirror" for name in left)
    datasets = [
        f"/data/{limb.name}_{role}/"
        for limb in registry.LIMBS.values()
        if limb.mirror_of
        for role in ("voluntary", "reflex")
    ]
    assert not [name for name in planned if any(dataset in name for dataset in datasets)]


def test_left_limbs_may_be_trained(workplace):
    workplace.edit("config/config.yaml", "left_limbs: mirrored", "left_limbs: trained")
    planned = workplace.outputs()
    assert "mirror" not in planned.values()
    for net in registry.NETS:
        assert planned[f"results/smoke/nets/{net}/weights.h5"] == final_rule(net)
    assert planned["results/smoke/data/left_leg_voluntary/round0/shard0000.h5"] == "voluntary_shard"


def test_bodies_have_the_fibers_of_the_whole_one(finished):
    told = finished.snakemake("--dry-run", "--forceall").stdout
    for body in ("nakada2018", "whole_fixed", "right_leg"):
        job = told[: told.index(f"output: results/smoke/body/{body}/model.mjb")]
        assert "results/smoke/body/zhou2021/muscles.csv" in job.rstrip().splitlines()[-1]


def test_a_demo_waits_for_its_own_nets(finished):
    told = finished.snakemake("--dry-run", "--forceall").stdout
    job = told[: told.index("output: results/smoke/demos/reach_left_leg_paper/rollout.h5")].rstrip().splitlines()[-1]
    nets = {part.strip().split("/")[3] for part in job.split(",") if "/nets/" in part and "/specs/" not in part}
    assert nets == {"left_leg_voluntary_paper", "left_leg_reflex"}
    job = told[: told.index("output: results/smoke/demos/on_off/rollout.h5")].rstrip().splitlines()[-1]
    assert "results/smoke/demos/choice.json" in job


def test_figures_of_the_vision_nets_wait_for_nets_data_and_errors(finished):
    told = finished.snakemake("--dry-run", "--forceall").stdout
    waited = {
        "saliency": (
            "data/eyes_foveation/shard0000.h5",
            "nets/foveation_left/weights.h5",
            "specs/data/eyes_foveation.json",
        ),
        "vision_error": ("nets/vision/errors.h5",),
        "fig16_vision_training": ("nets/right_arm_vision_left/round0/loss.csv",),
        "fig22_perception": ("demos/perception/rollout.h5",),
    }
    for figure, names in waited.items():
        job = told[: told.index(f"output: results/smoke/figures/nakada2018/{figure}.png")].rstrip().splitlines()[-1]
        assert all(f"results/smoke/{name}" in job for name in names), figure


def test_a_demo_that_sees_waits_for_its_vision_nets_and_the_loops_plan(finished):
    told = finished.snakemake("--dry-run", "--forceall").stdout

    def needs(demo):
        first = "rollout.h5" if registry.DEMOS[demo].rollout else "metrics.json"
        job = told[: told.index(f"output: results/smoke/demos/{demo}/{first}")].rstrip().splitlines()[-1]
        return {part.strip().removeprefix("results/smoke/") for part in job.split(",")}

    def nets(*roles):
        return {f"nets/{role}_{side}/weights.h5" for role in roles for side in ("left", "right")}

    reaching = [f"{limb}_vision" for limb in registry.REACHING]
    assert needs("perception") >= {"specs/loop.json"} | nets("foveation", "right_arm_vision")
    assert needs("perception_uniform") >= nets("uniform_foveation", "uniform_right_arm_vision")
    for demo in ("cannon", "shaken", "sight_timing"):
        assert needs(demo) >= {"specs/loop.json"} | nets("foveation", *reaching)
    assert not needs("hold") & ({"specs/loop.json"} | nets("foveation"))
    assert "specs/feedback.json" in needs("hold") and "specs/feedback.json" not in needs("eyes")


def test_students_of_a_round_are_the_nets_of_the_round_before(finished):
    told = finished.snakemake("--dry-run", "--forceall").stdout
    shard = told[: told.index("output: results/smoke/data/right_arm_voluntary/round1/shard0000.h5")]
    inputs = shard.rstrip().splitlines()[-1]
    for net in registry.LIMBS["right_arm"].nets.values():
        assert f"results/smoke/nets/{net}/round0/weights.h5" in inputs
    first = told[: told.index("output: results/smoke/data/right_arm_voluntary/round0/shard0000.h5")]
    assert "nets/" not in first.rstrip().splitlines()[-1].replace("specs/nets", "")


@pytest.mark.parametrize("scale", ["laptop", "paper"])
def test_larger_scales_are_planned(workplace, scale):
    planned = workplace.outputs(scale)
    settings = config.load({"scale": scale})
    shards = [name for name, rule in planned.items() if rule == "voluntary_shard"]
    trained = (name for name, limb in registry.LIMBS.items() if not limb.mirror_of)
    sizes = [config.sizes_of(settings, f"{name}_voluntary") for name in trained]
    assert len(shards) == sum(size["rounds"] * size["voluntary"]["shards"] for size in sizes)


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        (
            "config/scales/smoke.yaml",
            "  all_six:",
            "  all_seven:",
            "config/scales/smoke.yaml: demos.all_seven: 1: unknown",
        ),
        ("config/config.yaml", "seed: 7", "seed: seven", "config/config.yaml: seed: 'seven' is not of type 'integer'"),
    ],
)
def test_bad_settings_stop_at_once_in_one_line(workplace, name, old, new, told):
    workplace.edit(name, old, new)
    answer = workplace.snakemake("--dry-run")
    assert answer.returncode != 0
    assert told in answer.stdout and "Traceback" not in answer.stdout
