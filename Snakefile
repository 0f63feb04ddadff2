"""From anatomy tables to a moving body: one target per paper, `all` for everything."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(workflow.basedir) / "src"))

from anthro import registry
from anthro.body.parts import BODIES
from anthro.config import (
    SEES,
    SIGHT,
    ablation_spec,
    data_spec,
    emulator_spec,
    load,
    net_spec,
    plant_spec,
    role_of,
    sizes_of,
)
from anthro.errors import UserError
from anthro.files import canonical
from anthro.sources import source_files
from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version

min_version("9.27")

os.environ.setdefault("MUJOCO_GL", "disable")  # jobs start sooner: no picture is drawn by MuJoCo

try:
    settings = load(config, workflow.basedir)
except UserError as error:
    raise WorkflowError(str(error)) from None


wildcard_constraints:
    run=settings["run"].replace(".", r"\."),
    body="|".join(BODIES),
    limb="|".join(registry.LIMBS),
    net="|".join(registry.NETS),
    sight="|".join(name for name in settings["data"] if role_of(name) in SIGHT),
    table="|".join(registry.ABLATIONS),
    demo="|".join(registry.DEMOS),
    plant="|".join(registry.PLANTS),
    emulator="|".join(registry.EMULATORS),
    task="|".join(registry.TASKS),
    paper="|".join(settings["papers"]),
    round=r"\d+",
    steps=r"\d+",
    shard=r"\d{4}",
    row=r"[^/]+",


include: "workflow/rules/common.smk"
include: "workflow/rules/specs.smk"
include: "workflow/rules/body.smk"
include: "workflow/rules/data.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/ablate.smk"
include: "workflow/rules/demos.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/neuroanimator.smk"


rule nakada2018:
    input:
        [path.format(run=settings["run"]) for path in figures_of("nakada2018")],
        f"results/{settings['run']}/scorecard.csv",
        f"results/{settings['run']}/cost.csv",
    localrule: True


rule zhou2021:
    input:
        [path.format(run=settings["run"]) for path in figures_of("zhou2021")],
        f"results/{settings['run']}/body/inventory.html",
        f"results/{settings['run']}/scorecard.csv",
    localrule: True


rule all:
    default_target: True
    input:
        rules.nakada2018.input,
        rules.zhou2021.input,
        rules.neuroanimator.input,
    localrule: True
