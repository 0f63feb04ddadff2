# Tables to bodies, and what is measured on a body before anything learns on it.


rule body:
    input:
        code=source_files("anthro.body.build"),
        tables=lambda wildcards: tables_of(wildcards.body),
        fibers=fibers_of,
    output:
        model="results/{run}/body/{body}/model.mjb",
        muscles="results/{run}/body/{body}/muscles.csv",
        joints="results/{run}/body/{body}/joints.csv",
        ligaments="results/{run}/body/{body}/ligaments.csv",
        contacts="results/{run}/body/{body}/contacts.csv",
        fit="results/{run}/body/{body}/fit.json",
        card="results/{run}/body/{body}/run_card.json",
    log:
        "results/{run}/logs/body/{body}.log",
    benchmark:
        "results/{run}/benchmarks/body/{body}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        seed=settings["seed"],
        samples=settings["sizes"]["body"]["samples"],
        fibers=lambda wildcards, input: f"--fibers {Path(input.fibers[0]).parent}" if input.fibers else "",
        folder=subpath(output.model, parent=True),
    shell:
        "python -m anthro.body.build --body {wildcards.body} --seed {params.seed} --samples {params.samples}"
        " {params.fibers} --out {params.folder} > {log} 2>&1"


rule body_check:
    input:
        code=source_files("anthro.body.check"),
        body=body_of("{body}"),
        tables=lambda wildcards: tables_of(wildcards.body),
        references=sorted(map(str, Path("config/body/references").glob("*.csv"))),
    output:
        rows="results/{run}/body/{body}/check/rows.json",
        report="results/{run}/body/{body}/check/report.json",
        card="results/{run}/body/{body}/check/run_card.json",
    log:
        "results/{run}/logs/body/{body}_check.log",
    benchmark:
        "results/{run}/benchmarks/body/{body}_check.tsv"
    conda:
        "../../environment.yml"
    threads: 2
    params:
        seed=settings["seed"],
        sizes=settings["sizes"]["body"],
        body=lambda wildcards, input: Path(input.body[0]).parent,
        folder=subpath(output.rows, parent=True),
    shell:
        "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m anthro.body.check --variant {wildcards.body}"
        " --body {params.body} --seed {params.seed} --poses {params.sizes[poses]} --seconds {params.sizes[seconds]}"
        " --starts {params.sizes[starts]} --jobs {threads} --out {params.folder} > {log} 2>&1"


rule body_benchmark:
    input:
        code=source_files("anthro.body.benchmark"),
        body=body_of("zhou2021"),
    output:
        rows="results/{run}/body/zhou2021/benchmark/rows.json",
        metrics="results/{run}/body/zhou2021/benchmark/metrics.json",
        card="results/{run}/body/zhou2021/benchmark/run_card.json",
    log:
        "results/{run}/logs/body/benchmark.log",
    benchmark:
        "results/{run}/benchmarks/body/benchmark.tsv"
    conda:
        "../../environment.yml"
    threads: workflow.cores
    params:
        seconds=settings["sizes"]["body"]["benchmark_seconds"],
        body=lambda wildcards, input: Path(input.body[0]).parent,
        folder=subpath(output.rows, parent=True),
    shell:
        "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m anthro.body.benchmark --body {params.body}"
        " --seconds {params.seconds} --out {params.folder} > {log} 2>&1"


rule inventory:
    input:
        code=source_files("anthro.body.inventory"),
        body=body_of("zhou2021"),
        tables=tables_of("zhou2021"),
    output:
        report(
            "results/{run}/body/inventory.html",
            caption="../report/inventory.rst",
            category="zhou2021",
            labels={"figure": "Inventory"},
        ),
    log:
        "results/{run}/logs/body/inventory.log",
    benchmark:
        "results/{run}/benchmarks/body/inventory.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        body=lambda wildcards, input: Path(input.body[0]).parent,
    shell:
        "python -m anthro.body.inventory --body {params.body} --out {output} > {log} 2>&1"
