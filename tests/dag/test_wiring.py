"""Everything in the registry is in the DAG, at every scale, and bad settings stop it."""

import pytest

from anthro import config, registry


@pytest.fixture(scope="module")
def planned(finished):
    return finished.outputs()


def test_every_limb_net_demo_figure_and_ablation_is_made(planned):
    run = "results/smoke"
    wanted = {f"{run}/body/{limb}/model.mjb": "body" for limb in registry.LIMBS}
    wanted |= {f"{run}/nets/{net}/weights.h5": "final_net" for net in registry.NETS}
    wanted |= {f"{run}/nets/{net}/round0/loss.csv": "train" for net in registry.NETS}
    for table in registry.ABLATIONS:
        rows = config.load({"scale": "smoke"})["ablations"][table]
        wanted |= {f"{run}/ablations/{table}/{row}/loss.csv": "ablate" for row in rows}
    assert {name: planned.get(name) for name in wanted} == wanted
    for demo in registry.DEMOS:
        assert f"{run}/demos/{demo}/rows.json" in planned
    for figure in registry.FIGURES:
        assert f"figure_{figure}" in planned.values()
    assert planned[f"{run}/scorecard.csv"] == "scorecard"


def test_students_of_a_round_are_the_nets_of_the_round_before(finished):
    told = finished.snakemake("--dry-run", "--forceall").stdout
    shard = told[: told.index("output: results/smoke/data/right_arm_voluntary/round1/shard0000.h5")]
    inputs = shard.rstrip().splitlines()[-1]
    for net in registry.NETS:
        assert f"results/smoke/nets/{net}/round0/weights.h5" in inputs
    first = told[: told.index("output: results/smoke/data/right_arm_voluntary/round0/shard0000.h5")]
    assert "nets/" not in first.rstrip().splitlines()[-1].replace("specs/nets", "")


@pytest.mark.parametrize("scale", ["laptop", "paper"])
def test_larger_scales_are_planned(workplace, scale):
    planned = workplace.outputs(scale)
    sizes = config.load({"scale": scale})["sizes"]
    shards = [name for name, rule in planned.items() if rule == "voluntary_shard"]
    assert len(shards) == sizes["rounds"] * sizes["voluntary"]["shards"]


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("config/scales/smoke.yaml", "rounds:", "round:", "config/scales/smoke.yaml: round: 2: unknown key"),
        ("config/config.yaml", "seed: 7", "seed: seven", "config/config.yaml: seed: 'seven' is not of type 'integer'"),
    ],
)
def test_bad_settings_stop_at_once_in_one_line(workplace, name, old, new, told):
    workplace.edit(name, old, new)
    answer = workplace.snakemake("--dry-run")
    assert answer.returncode != 0
    assert told in answer.stdout and "Traceback" not in answer.stdout
