# One rule trains every net. The state folder is no declared output: Snakemake would delete it with a
# killed job, and the next run goes on from it.


rule train:
    input:
        code=source_files("anthro.learn.train"),
        spec="results/{run}/specs/nets/{net}.json",
        shards=lambda wildcards: shards_of(
            settings["nets"][wildcards.net]["dataset"], wildcards.run, int(wildcards.round) + 1
        ),
    output:
        weights="results/{run}/nets/{net}/round{round}/weights.h5",
        loss="results/{run}/nets/{net}/round{round}/loss.csv",
        card="results/{run}/nets/{net}/round{round}/run_card.json",
    log:
        "results/{run}/logs/nets/{net}/round{round}.log",
    benchmark:
        "results/{run}/benchmarks/nets/{net}/round{round}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    resources:
        gpu=1,
    params:
        folder=subpath(output.weights, parent=True),
        state="results/{run}/state/nets/{net}/round{round}",
    shell:
        "python -m anthro.learn.train --spec {input.spec} --shards {input.shards}"
        " --state {params.state} --threads {threads} --out {params.folder} > {log} 2>&1"


# Of a net that moves a limb, the round that does its task best on validation targets; of others, the last.
rule select:
    input:
        code=source_files("anthro.demos.select"),
        rounds=lambda wildcards: rounds_files(wildcards.net, "weights.h5", wildcards.run),
        reflex=lambda wildcards: f"results/{wildcards.run}/nets/{limb_of(wildcards).nets['reflex']}/weights.h5",
        specs=lambda wildcards: [
            f"results/{wildcards.run}/specs/{name}.json"
            for name in (f"data/{limb_of(wildcards).name}_voluntary", "feedback")
        ],
        body=lambda wildcards: body_of(*shown_by(wildcards).bodies, run=wildcards.run),
    output:
        weights="results/{run}/nets/{net}/weights.h5",
        selection="results/{run}/nets/{net}/selection.json",
    log:
        "results/{run}/logs/nets/{net}/select.log",
    benchmark:
        "results/{run}/benchmarks/nets/{net}/select.tsv"
    wildcard_constraints:
        net="|".join(SELECTED),
    conda:
        "../../environment.yml"
    threads: 1
    params:
        limb=lambda wildcards: limb_of(wildcards).name,
        inputs=lambda wildcards: shown_by(wildcards).inputs,
        targets=lambda wildcards: sizes_of(settings, settings["nets"][wildcards.net]["dataset"])["trials"],
        seed=settings["seed"],
        folder=subpath(output.weights, parent=True),
    shell:
        "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m anthro.demos.select --run results/{wildcards.run}"
        " --limb {params.limb} --inputs {params.inputs} --targets {params.targets} --seed {params.seed}"
        " --rounds {input.rounds} --out {params.folder} > {log} 2>&1"


rule final_net:
    input:
        source_of,
    output:
        "results/{run}/nets/{net}/weights.h5",
    log:
        "results/{run}/logs/nets/{net}/final.log",
    wildcard_constraints:
        net="|".join(net for net in TRAINED if net not in SELECTED),
    localrule: True
    conda:
        "../../environment.yml"
    shell:
        "cp {input} {output} 2> {log}"


# A left limb's muscles come in its twin's order: only the target's offset to the left changes its sign.
if MIRRORED:

    rule mirror:
        input:
            code=source_files("anthro.learn.mirror"),
            weights=source_of,
        output:
            "results/{run}/nets/{net}/weights.h5",
        log:
            "results/{run}/logs/nets/{net}/mirror.log",
        wildcard_constraints:
            net="|".join(MIRRORED),
        localrule: True
        conda:
            "../../environment.yml"
        params:
            signs=branch(
                lambda wildcards: registry.NETS[wildcards.net].role == "voluntary", then="--offset-signs 1 -1 1"
            ),
        shell:
            "python -m anthro.learn.mirror --weights {input.weights} {params.signs} --name {wildcards.net}"
            " --out {output} > {log} 2>&1"


rule outcome:
    input:
        code=source_files("anthro.learn.outcome"),
        cards=[card for net in TRAINED for card in rounds_files(net, "run_card.json")],
        selections=[f"results/{{run}}/nets/{net}/selection.json" for net in SELECTED],
    output:
        "results/{run}/nets/rows.json",
    log:
        "results/{run}/logs/nets/outcome.log",
    benchmark:
        "results/{run}/benchmarks/nets/outcome.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    shell:
        "python -m anthro.learn.outcome --cards {input.cards} --selections {input.selections}"
        " --out {output} > {log} 2>&1"


rule cost:
    input:
        code=source_files("anthro.cost"),
        sizes="config/scales/paper.yaml",
        specs=[f"results/{{run}}/specs/data/{name}.json" for name in DATASETS],
        shards=[shards_of(name, "{run}", 1)[0] for name in DATASETS],
        cards=[card for net in TRAINED for card in rounds_files(net, "run_card.json")],
    output:
        "results/{run}/cost.csv",
    log:
        "results/{run}/logs/cost.log",
    benchmark:
        "results/{run}/benchmarks/cost.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    shell:
        "python -m anthro.cost --run results/{wildcards.run} --scale paper --out {output} > {log} 2>&1"


rule sight_errors:
    input:
        code=source_files("anthro.eyes.measure"),
        specs=[f"results/{{run}}/specs/data/{name}.json" for name in sorted(SIGHT_SETS)],
        body=body_of(SEES),
        nets=[f"results/{{run}}/nets/{net}/weights.h5" for net, told in registry.NETS.items() if told.role in SIGHT],
    output:
        rows="results/{run}/nets/vision/rows.json",
        errors="results/{run}/nets/vision/errors.h5",
        card="results/{run}/nets/vision/run_card.json",
    log:
        "results/{run}/logs/nets/vision.log",
    benchmark:
        "results/{run}/benchmarks/nets/vision.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        body=lambda wildcards, input: Path(input.body[0]).parent,
        scenes=settings["sizes"]["sight"]["held_out"],
        folder=subpath(output.rows, parent=True),
    shell:
        "python -m anthro.eyes.measure --run results/{wildcards.run} --body {params.body} --scenes {params.scenes}"
        " --out {params.folder} > {log} 2>&1"
