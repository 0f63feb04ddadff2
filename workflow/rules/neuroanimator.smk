# NeuroAnimator (Grzeszczuk 1998): a plant's examples, pairs for each of its networks, training, what came of it.

NEURO = settings["sizes"]["neuroanimator"]
SINGLE = "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m"


rule sample:
    input:
        code=source_files("anthro.neuroanimator.sample"),
        spec="results/{run}/specs/neuroanimator/data/{plant}_n{steps}.json",
    output:
        "results/{run}/neuroanimator/data/{plant}_n{steps}.h5",
    log:
        "results/{run}/logs/neuroanimator/data/{plant}_n{steps}.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/data/{plant}_n{steps}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        call=SINGLE,
    shell:
        "{params.call} anthro.neuroanimator.sample --spec {input.spec} --out {output} > {log} 2>&1"


rule present:
    input:
        code=source_files("anthro.neuroanimator.present"),
        spec="results/{run}/specs/neuroanimator/nets/{emulator}.json",
        examples=examples_of,
    output:
        pairs="results/{run}/neuroanimator/pairs/{emulator}/pairs.h5",
        operators="results/{run}/neuroanimator/pairs/{emulator}/operators.h5",
    log:
        "results/{run}/logs/neuroanimator/pairs/{emulator}.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/pairs/{emulator}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        call=SINGLE,
        folder=subpath(output.pairs, parent=True),
    shell:
        "{params.call} anthro.neuroanimator.present --spec {input.spec} --examples {input.examples}"
        " --out {params.folder} > {log} 2>&1"


use rule train as train_emulator with:
    input:
        code=source_files("anthro.learn.train"),
        spec="results/{run}/specs/neuroanimator/nets/{emulator}.json",
        shards="results/{run}/neuroanimator/pairs/{emulator}/pairs.h5",
    output:
        weights="results/{run}/neuroanimator/nets/{emulator}/weights.h5",
        loss="results/{run}/neuroanimator/nets/{emulator}/loss.csv",
        card="results/{run}/neuroanimator/nets/{emulator}/run_card.json",
    log:
        "results/{run}/logs/neuroanimator/nets/{emulator}.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/nets/{emulator}.tsv"
    params:
        folder=subpath(output.weights, parent=True),
        state="results/{run}/state/neuroanimator/nets/{emulator}",


rule accuracy:
    input:
        code=source_files("anthro.neuroanimator.accuracy"),
        nets=lambda wildcards: emulator_files([wildcards.plant], wildcards.run),
    output:
        rollout="results/{run}/neuroanimator/accuracy/{plant}/rollout.h5",
        metrics="results/{run}/neuroanimator/accuracy/{plant}/metrics.json",
        rows="results/{run}/neuroanimator/accuracy/{plant}/rows.json",
        card="results/{run}/neuroanimator/accuracy/{plant}/run_card.json",
    log:
        "results/{run}/logs/neuroanimator/accuracy/{plant}.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/accuracy/{plant}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        call=SINGLE,
        steps=lambda wildcards: " ".join(map(str, registry.PLANTS[wildcards.plant])),
        flags=f"--trials {NEURO['trials']} --length {NEURO['length']} --horizon {NEURO['horizon']}",
        seed=settings["seed"],
        folder=subpath(output.rows, parent=True),
    shell:
        "{params.call} anthro.neuroanimator.accuracy --run results/{wildcards.run} --plant {wildcards.plant}"
        " --super-steps {params.steps} {params.flags} --seed {params.seed} --out {params.folder} > {log} 2>&1"


# Time is measured with the machine to itself: all cores are taken, one is used.
rule table2:
    input:
        code=source_files("anthro.neuroanimator.timing"),
        nets=emulator_files([plant for plant in registry.PLANTS if plant != "forced_pendulum"]),
    output:
        metrics="results/{run}/neuroanimator/timing/table2/metrics.json",
        rows="results/{run}/neuroanimator/timing/table2/rows.json",
        card="results/{run}/neuroanimator/timing/table2/run_card.json",
    log:
        "results/{run}/logs/neuroanimator/timing/table2.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/timing/table2.tsv"
    conda:
        "../../environment.yml"
    threads: workflow.cores
    params:
        call=SINGLE,
        flags=f"--steps {NEURO['timing_steps']} --rounds {NEURO['timing_rounds']} --seed {settings['seed']}",
        folder=subpath(output.rows, parent=True),
    shell:
        "{params.call} anthro.neuroanimator.timing --run results/{wildcards.run} {params.flags}"
        " --out {params.folder} > {log} 2>&1"


rule control:
    input:
        code=source_files("anthro.neuroanimator.synthesize"),
        nets=task_files,
    output:
        rollout="results/{run}/neuroanimator/control/{task}/rollout.h5",
        metrics="results/{run}/neuroanimator/control/{task}/metrics.json",
        rows="results/{run}/neuroanimator/control/{task}/rows.json",
        card="results/{run}/neuroanimator/control/{task}/run_card.json",
    log:
        "results/{run}/logs/neuroanimator/control/{task}.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/control/{task}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        call=SINGLE,
        folder=subpath(output.rows, parent=True),
    shell:
        "{params.call} anthro.neuroanimator.synthesize --run results/{wildcards.run} --task {wildcards.task}"
        " --out {params.folder} > {log} 2>&1"


rule search:
    input:
        code=source_files("anthro.neuroanimator.search"),
        nets=task_files,
    output:
        metrics="results/{run}/neuroanimator/search/{task}/metrics.json",
        rows="results/{run}/neuroanimator/search/{task}/rows.json",
        card="results/{run}/neuroanimator/search/{task}/run_card.json",
    log:
        "results/{run}/logs/neuroanimator/search/{task}.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/search/{task}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        call=SINGLE,
        flags=f"--evaluations {NEURO['evaluations']} --seeds {NEURO['seeds']} --seed {settings['seed']}",
        folder=subpath(output.rows, parent=True),
    shell:
        "{params.call} anthro.neuroanimator.search --run results/{wildcards.run} --task {wildcards.task}"
        " {params.flags} --out {params.folder} > {log} 2>&1"


use rule scorecard as neuroanimator_scorecard with:
    input:
        neuro_rows(),
    output:
        "results/{run}/neuroanimator/scorecard.csv",
    log:
        "results/{run}/logs/neuroanimator/scorecard.log",
    benchmark:
        "results/{run}/benchmarks/neuroanimator/scorecard.tsv"


rule neuroanimator:
    input:
        [path.format(run=settings["run"]) for path in figures_of("grzeszczuk1998")],
        f"results/{settings['run']}/neuroanimator/scorecard.csv",
    localrule: True
