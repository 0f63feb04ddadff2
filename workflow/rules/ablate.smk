# Each row of config/ablations/*.tsv is a training of its own. Their times are compared: all have one thread.


use rule train as ablate with:
    input:
        code=source_files("anthro.learn.train"),
        spec="results/{run}/specs/ablations/{table}/{row}.json",
        shards=ablation_shards,
    output:
        weights="results/{run}/ablations/{table}/{row}/weights.h5",
        loss="results/{run}/ablations/{table}/{row}/loss.csv",
        card="results/{run}/ablations/{table}/{row}/run_card.json",
    log:
        "results/{run}/logs/ablations/{table}/{row}.log",
    benchmark:
        "results/{run}/benchmarks/ablations/{table}/{row}.tsv"
    params:
        folder=subpath(output.weights, parent=True),
        state="results/{run}/state/ablations/{table}/{row}",


rule findings:
    input:
        code=source_files("anthro.learn.findings"),
        tables=[
            f"results/{{run}}/ablations/{table}/{row}/{part}"
            for table in registry.ABLATIONS
            for row in settings["ablations"][table]
            for part in PARTS[1:]
        ],
    output:
        "results/{run}/ablations/rows.json",
    log:
        "results/{run}/logs/ablations/findings.log",
    benchmark:
        "results/{run}/benchmarks/ablations/findings.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        folder=subpath(output[0], parent=True),
    shell:
        "python -m anthro.learn.findings --run results/{wildcards.run} --out {params.folder} > {log} 2>&1"
