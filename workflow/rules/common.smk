# What the rules share: where things lie, and which round or variant needs what.
#
# `code` inputs: a rule lists the module that it calls and all that this module imports inside the
# package (anthro.sources), so that an edit reruns what depends on it and nothing else.


TRAINED = ("weights.h5", "loss.csv", "run_card.json")


def body_of(body):
    """The parts of a body that later stages read."""
    parts = ("model.mjb", "muscles.csv", "joints.csv", "ligaments.csv", "contacts.csv")
    return [f"results/{{run}}/body/{body}/{name}" for name in parts]


def tables_of(body):
    """The anatomy that a body is made of."""
    regions = [path for name in BODIES[body].regions for path in Path("config/body", name).glob("*.csv")]
    return sorted(map(str, [*Path("config/body").glob("*.csv"), *regions]))


def rounds_of(net):
    """Rounds of aggregation of a net: the reflex has one, its data need no student."""
    return settings["sizes"]["rounds"] if registry.NETS[net].role == "voluntary" else 1


def shards_of(dataset, run, rounds):
    """Shards of a data set's first rounds, oldest first."""
    role = role_of(dataset)
    folders = [f"round{number}/" for number in range(rounds)] if role == "voluntary" else [""]
    count = settings["sizes"][role]["shards"]
    return [f"results/{run}/data/{dataset}/{folder}shard{shard:04d}.h5" for folder in folders for shard in range(count)]


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


def initial_of(wildcards):
    """Weights of the round before, from which a round goes on."""
    before = int(wildcards.round) - 1
    return f"results/{wildcards.run}/nets/{wildcards.net}/round{before}/weights.h5" if before >= 0 else []


def final_nets(limb):
    """A limb's nets after the last round."""
    return [f"results/{{run}}/nets/{net}/weights.h5" for net in registry.LIMBS[limb].nets.values()]


def ablation_shards(wildcards):
    """All rounds of the data set of the net that is varied."""
    dataset = ablation_spec(settings, wildcards.table, wildcards.row)["dataset"]
    return shards_of(dataset, wildcards.run, settings["sizes"]["rounds"])


def content_of(wildcards):
    """A spec's content as one line of JSON, which is what decides whether it is written anew."""
    stage, _, name = wildcards.job.partition("/")
    if stage == "data":
        return canonical(data_spec(settings, name))
    if stage == "nets":
        return canonical(net_spec(settings, name))
    table, _, row = name.partition("/")
    return canonical(ablation_spec(settings, table, row))


def demo_flags(wildcards):
    """What a demo is asked for on its command line."""
    demo = registry.DEMOS[wildcards.demo]
    flags = [f"--limb {demo.limb}", f"--seed {settings['seed']}"]
    if demo.inputs:
        flags += [f"--inputs {demo.inputs}"]
    targets = settings["sizes"]["demos"].get(demo.module.rpartition(".")[2])
    if targets:
        flags += [f"--targets {targets}"]
    return " ".join(flags)


def needs_of(figure):
    """The files that a figure is drawn from, by the parts of a run that its paper's YAML names."""
    files = []
    for need in figure_told(figure)["needs"]:
        stage, _, name = need.partition("/")
        if stage == "body":
            files += body_of(name)
        elif stage == "nets":
            files += [f"results/{{run}}/nets/{name}/round{number}/loss.csv" for number in range(rounds_of(name))]
        elif stage == "demos":
            files += demo_files(name)
        else:
            rows = settings["ablations"][name]
            files += [f"results/{{run}}/ablations/{name}/{row}/{part}" for row in rows for part in TRAINED[1:]]
    return files


def demo_files(demo):
    """What figures read of a demo."""
    parts = ["metrics.json"]
    if demo == "solvers":
        parts += ["solver_comparison.csv"]
    elif not registry.DEMOS[demo].alone:
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
    """The module that draws a figure: its own script, or the camera for a video."""
    return (
        "anthro.render.film"
        if "film" in figure_told(figure)
        else f"anthro.figures.{registry.FIGURES[figure].paper}.{figure}"
    )


def figure_sources(figure):
    """The sources of a figure, and the look of all plots."""
    files = source_files(figure_module(figure))
    return files if "film" in figure_told(figure) else [*files, "src/anthro/figures/house.mplstyle"]


def film_flags(figure):
    """Which rollout a video shows, and its size; nothing for a plot."""
    if "film" not in figure_told(figure):
        return ""
    film = settings["sizes"]["film"]
    return f"--demo {figure_told(figure)['film']} --width {film['width']} --height {film['height']} --fps {film['fps']}"
