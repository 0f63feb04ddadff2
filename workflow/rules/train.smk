# One rule trains every net. The state folder is no declared output: Snakemake would delete it with a
# killed job, and the next run goes on from it.


rule train:
    input:
        code=source_files("anthro.learn.train"),
        spec="results/{run}/specs/nets/{net}.json",
        shards=lambda wildcards: shards_of(
            settings["nets"][wildcards.net]["dataset"], wildcards.run, int(wildcards.round) + 1
        ),
        initial=initial_of,
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
        initial=lambda wildcards, input: f"--initial {input.initial}" if input.initial else "",
        state="results/{run}/state/nets/{net}/round{round}",
    shell:
        "python -m anthro.learn.train --spec {input.spec} --shards {input.shards} {params.initial}"
        " --state {params.state} --threads {threads} --out {params.folder} > {log} 2>&1"


rule final_net:
    input:
        lambda wildcards: (
            f"results/{wildcards.run}/nets/{wildcards.net}/round{rounds_of(wildcards.net) - 1}/weights.h5"
        ),
    output:
        "results/{run}/nets/{net}/weights.h5",
    log:
        "results/{run}/logs/nets/{net}/final.log",
    localrule: True
    conda:
        "../../environment.yml"
    shell:
        "cp {input} {output} 2> {log}"


rule outcome:
    input:
        code=source_files("anthro.learn.outcome"),
        cards=lambda wildcards: [
            f"results/{wildcards.run}/nets/{net}/round{number}/run_card.json"
            for net in registry.NETS
            for number in range(rounds_of(net))
        ],
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
        "python -m anthro.learn.outcome --cards {input.cards} --out {output} > {log} 2>&1"
