# A demo that measures time takes all cores, so that nothing runs beside it, and uses one.

MOVING = [name for name, demo in registry.DEMOS.items() if demo.rollout]
MEASURING = [name for name, demo in registry.DEMOS.items() if not demo.rollout and name != "solvers"]
CHOICE = [name for name, demo in registry.DEMOS.items() if demo.inputs]


rule demo:
    input:
        code=lambda wildcards: source_files(registry.DEMOS[wildcards.demo].module),
        bodies=demo_bodies,
        limbs=demo_limbs,
        sight=demo_sight,
        choice=branch(lambda wildcards: wildcards.demo not in CHOICE, then="results/{run}/demos/choice.json"),
    output:
        rollout="results/{run}/demos/{demo}/rollout.h5",
        metrics="results/{run}/demos/{demo}/metrics.json",
        rows="results/{run}/demos/{demo}/rows.json",
        card="results/{run}/demos/{demo}/run_card.json",
    log:
        "results/{run}/logs/demos/{demo}.log",
    benchmark:
        "results/{run}/benchmarks/demos/{demo}.tsv"
    wildcard_constraints:
        demo="|".join(MOVING),
    conda:
        "../../environment.yml"
    threads: 1
    params:
        module=lambda wildcards: registry.DEMOS[wildcards.demo].module,
        flags=demo_flags,
        folder=subpath(output.metrics, parent=True),
    shell:
        "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m {params.module} --run results/{wildcards.run}"
        " {params.flags} --out {params.folder} > {log} 2>&1"


use rule demo as measurement with:
    output:
        metrics="results/{run}/demos/{demo}/metrics.json",
        rows="results/{run}/demos/{demo}/rows.json",
        card="results/{run}/demos/{demo}/run_card.json",
    wildcard_constraints:
        demo="|".join(MEASURING),
    threads: demo_threads


rule choose_inputs:
    input:
        code=source_files("anthro.demos.choose"),
        selections=[f"results/{{run}}/nets/{net}/selection.json" for net in SELECTED],
    output:
        "results/{run}/demos/choice.json",
    log:
        "results/{run}/logs/demos/choice.log",
    localrule: True
    conda:
        "../../environment.yml"
    shell:
        "python -m anthro.demos.choose --selections {input.selections} --out {output} > {log} 2>&1"


rule solvers:
    input:
        code=source_files("anthro.motor.compare_solvers"),
        body=body_of(*registry.DEMOS["solvers"].bodies),
    output:
        table="results/{run}/demos/solvers/solver_comparison.csv",
        metrics="results/{run}/demos/solvers/metrics.json",
        rows="results/{run}/demos/solvers/rows.json",
        card="results/{run}/demos/solvers/run_card.json",
    log:
        "results/{run}/logs/demos/solvers.log",
    benchmark:
        "results/{run}/benchmarks/demos/solvers.tsv"
    conda:
        "../../environment.yml"
    threads: workflow.cores
    params:
        seed=settings["seed"],
        problems=settings["sizes"]["demos"]["solvers"],
        body=lambda wildcards, input: Path(input.body[0]).parent,
        folder=subpath(output.metrics, parent=True),
    shell:
        "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m anthro.motor.compare_solvers --body {params.body}"
        " --seed {params.seed} --problems {params.problems} --out {params.folder} > {log} 2>&1"


rule scorecard:
    input:
        bodies=[f"results/{{run}}/body/{name}/check/rows.json" for name in ("zhou2021", "nakada2018")],
        benchmark="results/{run}/body/zhou2021/benchmark/rows.json",
        demos=[f"results/{{run}}/demos/{name}/rows.json" for name in registry.DEMOS],
        findings="results/{run}/ablations/rows.json",
        nets="results/{run}/nets/rows.json",
        sight="results/{run}/nets/vision/rows.json",
        neuroanimator=neuro_rows(),
    output:
        report(
            "results/{run}/scorecard.csv",
            caption="../report/scorecard.rst",
            category="Scorecard",
            labels={"table": "Our numbers beside the papers'"},
        ),
    log:
        "results/{run}/logs/scorecard.log",
    benchmark:
        "results/{run}/benchmarks/scorecard.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    shell:
        "python -m anthro.scorecard --run results/{wildcards.run} --rows {input} --out {output} > {log} 2>&1"
