# What the rules share: where things lie, and which round or variant needs what.
#
# `code` inputs: a rule lists the module that it calls and all that this module imports inside the
# package (anthro.sources), so that an edit reruns what depends on it and nothing else.


PARTS = ("weights.h5", "loss.csv", "run_card.json")  # what a training leaves
MIRRORED = registry.mirrored_nets(settings["left_limbs"])  # nets that are not trained, and where they come from
NEURO_PARTS = {  # what figures read of the parts of results/<run>/neuroanimator/
    "accuracy": ("rollout.h5", "metrics.json"),
    "control": ("rollout.h5", "metrics.json"),
    "search": ("metrics.json",),
    "timing": ("metrics.json",),
}
TRAINED = [net for net in registry.NETS if net not in MIRRORED]
SELECTED = [net for net in TRAINED if registry.NETS[net].role == "voluntary"]
SIGHT_SETS = [name for name in settings["data"] if role_of(name) in SIGHT]
DATASETS = sorted({settings["nets"][net]["dataset"] for net in TRAINED})


def body_of(body, run="{run}"):
    """The parts of a body that later stages read."""
    parts = ("model.mjb", "muscles.csv", "joints.csv", "ligaments.csv", "contacts.csv")
    return [f"results/{run}/body/{body}/{name}" for name in parts]


def fibers_of(wildcards):
    """The body whose fibers a body has; nothing for the one that is fitted."""
    source = BODIES[wildcards.body].fibers_of
    return body_of(source, wildcards.run) if source else []


def training_body(wildcards):
    """The body on which a limb's data are synthesized."""
    return body_of(settings["limbs"][wildcards.limb]["body"], wildcards.run)


def tables_of(body):
    """The anatomy that a body is made of."""
    regions = [path for name in BODIES[body].regions for path in Path("config/body", name).glob("*.csv")]
    return sorted(map(str, [*Path("config/body").glob("*.csv"), *regions]))


def rounds_of(dataset):
    """Rounds of aggregation of a data set: the reflex's has one, it needs no student."""
    return sizes_of(settings, dataset)["rounds"] if role_of(dataset) == "voluntary" else 1


def shards_of(dataset, run, rounds):
    """Shards of a data set's first rounds, oldest first."""
    role = role_of(dataset)
    folders = [f"round{number}/" for number in range(rounds)] if role == "voluntary" else [""]
    count = sizes_of(settings, dataset)[role]["shards"]
    return [f"results/{run}/data/{dataset}/{folder}shard{shard:04d}.h5" for folder in folders for shard in range(count)]


def rounds_files(net, name, run="{run}"):
    """A file of each round of a trained net."""
    rounds = rounds_of(settings["nets"][net]["dataset"])
    return [f"results/{run}/nets/{net}/round{number}/{name}" for number in range(rounds)]


def students_of(wildcards):
    """Nets that drive a round's rollouts: those of the round before, none in round 0."""
    before = int(wildcards.round) - 1
    nets = registry.LIMBS[wildcards.limb].nets
    return [
        f"results/{wildcards.run}/nets/{net}/round{before}/weights.h5"
        for net in nets.values()
        if before >= 0 and registry.NETS[net].role == "voluntary"
    ]


def reflex_of(wildcards):
    """The reflex net that acts beside the students."""
    net = registry.LIMBS[wildcards.limb].nets["reflex"]
    return f"results/{wildcards.run}/nets/{net}/round0/weights.h5" if int(wildcards.round) else []


def source_of(wildcards):
    """What a net is made from: its last round, or the final net of the limb whose mirror image its limb is."""
    if wildcards.net in MIRRORED:
        return f"results/{wildcards.run}/nets/{MIRRORED[wildcards.net]}/weights.h5"
    return rounds_files(wildcards.net, "weights.h5", wildcards.run)[-1]


def limb_of(wildcards):
    """The limb that a net moves."""
    return registry.LIMBS[registry.NETS[wildcards.net].limb]


def shown_by(wildcards):
    """The demo that shows a voluntary net's limb at its task, with its inputs."""
    limb = limb_of(wildcards)
    return next(
        demo
        for demo in registry.DEMOS.values()
        if demo.inputs and demo.limbs == (limb.name,) and limb.nets[demo.inputs] == wildcards.net
    )


def foveating(wildcards):
    """The nets that turn the eyes to the ball in a limb's pictures; none for those that learn to."""
    prefix = settings["data"][wildcards.sight].get("foveated_by")
    return [f"results/{wildcards.run}/nets/{prefix}_{side}/weights.h5" for side in registry.SIDES if prefix]


def ablation_shards(wildcards):
    """All rounds of the data set of the net that is varied."""
    dataset = ablation_spec(settings, wildcards.table, wildcards.row)["dataset"]
    return shards_of(dataset, wildcards.run, rounds_of(dataset))


def content_of(wildcards):
    """A spec's content as one line of JSON, which is what decides whether it is written anew."""
    stage, _, name = wildcards.job.partition("/")
    if stage in ("feedback", "loop"):
        return canonical(settings[stage])
    if stage == "data":
        return canonical(data_spec(settings, name))
    if stage == "nets":
        return canonical(net_spec(settings, name))
    part, _, row = name.partition("/")
    if stage == "neuroanimator" and part == "data":
        plant, _, steps = row.rpartition("_n")
        return canonical(plant_spec(settings, plant, int(steps)))
    if stage == "neuroanimator":
        return canonical(emulator_spec(settings, row))
    return canonical(ablation_spec(settings, part, row))


def demo_bodies(wildcards):
    """The bodies that a demo moves."""
    return [path for body in registry.DEMOS[wildcards.demo].bodies for path in body_of(body, wildcards.run)]


def demo_limbs(wildcards):
    """What a demo reads of its limbs: what they are, and their nets; without the variant that is not asked for."""
    demo = registry.DEMOS[wildcards.demo]
    specs = [f"specs/data/{limb}_{role}.json" for limb in demo.limbs for role in ("voluntary", "reflex")]
    unused = set(registry.INPUTS) - {demo.inputs} if demo.inputs else set()
    nets = [net for limb in demo.limbs for name, net in registry.LIMBS[limb].nets.items() if name not in unused]
    specs += ["specs/feedback.json"] if demo.limbs else []
    return [f"results/{wildcards.run}/{path}" for path in [*specs, *(f"nets/{net}/weights.h5" for net in nets)]]


def demo_sight(wildcards):
    """What a demo that sees reads: the plan of its loop, and the vision nets of its eyes and limbs."""
    demo = registry.DEMOS[wildcards.demo]
    if demo.sight is None:
        return []
    prefix = f"{demo.retina}_" if demo.retina else ""
    roles = ["foveation", *(f"{limb}_vision" for limb in demo.sight)]
    nets = [f"nets/{prefix}{role}_{side}/weights.h5" for role in roles for side in ("left", "right")]
    return [f"results/{wildcards.run}/{path}" for path in ["specs/loop.json", *nets]]


def demo_threads(wildcards):
    """One core, or all to keep them idle."""
    return workflow.cores if registry.DEMOS[wildcards.demo].alone else 1


def demo_flags(wildcards):
    """What a demo is asked for on its command line."""
    demo = registry.DEMOS[wildcards.demo]
    flags = [demo.options, f"--seed {settings['seed']}"]
    if demo.inputs:
        flags += [f"--inputs {demo.inputs}"]
    targets = settings["sizes"]["demos"].get(demo.module.rpartition(".")[2])
    if targets:
        flags += [f"--targets {targets}"]
    return " ".join(filter(None, flags))


def needs_of(figure):
    """The files that a figure is drawn from, by the parts of a run that its paper's YAML names."""
    files = []
    for need in figure_told(figure)["needs"]:
        stage, _, name = need.partition("/")
        if "." in name:
            files += [f"results/{{run}}/{need}"]
        elif stage == "body":
            files += body_of(name)
        elif stage == "nets":
            files += rounds_files(MIRRORED.get(name, name), "loss.csv")
            files += [f"results/{{run}}/nets/{name}/weights.h5"]
        elif stage == "demos":
            files += demo_files(name)
        elif stage in NEURO_PARTS:
            files += [f"results/{{run}}/neuroanimator/{need}/{part}" for part in NEURO_PARTS[stage]]
        else:
            rows = settings["ablations"][name]
            files += [f"results/{{run}}/ablations/{name}/{row}/{part}" for row in rows for part in PARTS[1:]]
    return files


def demo_files(demo):
    """What figures read of a demo."""
    parts = ["metrics.json"]
    if demo == "solvers":
        parts += ["solver_comparison.csv"]
    elif registry.DEMOS[demo].rollout:
        parts += ["rollout.h5"]
    return [f"results/{{run}}/demos/{demo}/{part}" for part in parts]


def figure_file(figure):
    """Where a figure or video is written."""
    told = registry.FIGURES[figure]
    return f"results/{{run}}/figures/{told.paper}/{figure.removesuffix('_video')}.{told.suffix}"


def figures_of(paper):
    """All figures of a paper."""
    return [figure_file(name) for name, figure in registry.FIGURES.items() if figure.paper == paper]


def figure_told(figure):
    """What the paper's YAML says of a figure."""
    return settings["papers"][registry.FIGURES[figure].paper]["figures"][figure]


def figure_module(figure):
    """The module that draws a figure: its own script, or a camera for a video."""
    told = figure_told(figure)
    if "task" in told:
        return "anthro.neuroanimator.film"
    return "anthro.render.film" if "film" in told else f"anthro.figures.{registry.FIGURES[figure].paper}.{figure}"


def figure_sources(figure):
    """The sources of a figure, and the look of all plots."""
    files = source_files(figure_module(figure))
    return files if registry.FIGURES[figure].suffix == "mp4" else [*files, "src/anthro/figures/house.mplstyle"]


def film_flags(figure):
    """Which rollout a video shows, its size, and where the camera stands; nothing for a plot."""
    told = figure_told(figure)
    film = settings["sizes"]["film"]
    size = f"--width {film['width']} --height {film['height']} --fps {film['fps']}"
    if "task" in told:
        return f"--task {told['task']} {size}"
    if "film" not in told:
        return ""
    size = f"--demo {told['film']} {size}"
    return f"{size} --azimuth {told['azimuth']}" if "azimuth" in told else size


def neuro_rows(run="{run}"):
    """Rows of the scorecard that are made here."""
    parts = [f"accuracy/{plant}" for plant in registry.PLANTS] + ["timing/table2"]
    parts += [f"{stage}/{task}" for stage in ("control", "search") for task in registry.TASKS]
    return [f"results/{run}/neuroanimator/{part}/rows.json" for part in parts]


def emulator_files(plants, run="{run}"):
    """Networks and operators of some plants' emulators."""
    nets = [name for name, net in registry.EMULATORS.items() if net.plant in plants]
    files = [[f"nets/{net}/weights.h5", f"pairs/{net}/operators.h5"] for net in nets]
    return [f"results/{run}/neuroanimator/{path}" for path in sum(files, [])]


def examples_of(wildcards):
    """The examples of a network's plant at its super-step."""
    net = registry.EMULATORS[wildcards.emulator]
    return f"results/{wildcards.run}/neuroanimator/data/{net.plant}_n{net.super_step}.h5"


def task_files(wildcards):
    """Networks that a control task is learned through: those of one super-step, but all of them are read at once."""
    return emulator_files([registry.TASKS[wildcards.task]], wildcards.run)
