# One job a shard: two cores or two thousand nodes work on them side by side.


rule voluntary_shard:
    input:
        code=source_files("anthro.motor.synthesize"),
        spec="results/{run}/specs/data/{limb}_voluntary.json",
        body=training_body,
        students=students_of,
        reflex=reflex_of,
    output:
        "results/{run}/data/{limb}_voluntary/round{round}/shard{shard}.h5",
    log:
        "results/{run}/logs/data/{limb}_voluntary/round{round}/shard{shard}.log",
    benchmark:
        "results/{run}/benchmarks/data/{limb}_voluntary/round{round}/shard{shard}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        body=lambda wildcards, input: Path(input.body[0]).parent,
        nets=lambda wildcards, input: (f"--students {input.students} --reflex {input.reflex}" if input.students else ""),
    shell:
        "python -m anthro.motor.synthesize --spec {input.spec} --body {params.body} --round {wildcards.round}"
        " --shard {wildcards.shard} {params.nets} --out {output} > {log} 2>&1"


rule reflex_shard:
    input:
        code=source_files("anthro.motor.synthesize_reflex"),
        spec="results/{run}/specs/data/{limb}_reflex.json",
        body=training_body,
    output:
        "results/{run}/data/{limb}_reflex/shard{shard}.h5",
    log:
        "results/{run}/logs/data/{limb}_reflex/shard{shard}.log",
    benchmark:
        "results/{run}/benchmarks/data/{limb}_reflex/shard{shard}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        body=lambda wildcards, input: Path(input.body[0]).parent,
    shell:
        "python -m anthro.motor.synthesize_reflex --spec {input.spec} --body {params.body}"
        " --shard {wildcards.shard} --out {output} > {log} 2>&1"


rule sight_shard:
    input:
        code=source_files("anthro.eyes.synthesize"),
        spec="results/{run}/specs/data/{sight}.json",
        body=body_of(SEES),
        foveation=foveating,
    output:
        "results/{run}/data/{sight}/shard{shard}.h5",
    log:
        "results/{run}/logs/data/{sight}/shard{shard}.log",
    benchmark:
        "results/{run}/benchmarks/data/{sight}/shard{shard}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        body=lambda wildcards, input: Path(input.body[0]).parent,
        nets=lambda wildcards, input: f"--foveation {input.foveation}" if input.foveation else "",
    shell:
        "python -m anthro.eyes.synthesize --spec {input.spec} --body {params.body} --shard {wildcards.shard}"
        " {params.nets} --out {output} > {log} 2>&1"
