rule body:
    input:
        code=source_files("anthro.body.build"),
        tables=sorted(str(path) for path in Path("config/body").rglob("*.csv")),
    output:
        model="results/{run}/body/{limb}/model.mjb",
        muscles="results/{run}/body/{limb}/muscles.csv",
        joints="results/{run}/body/{limb}/joints.csv",
        fit="results/{run}/body/{limb}/fit.json",
        card="results/{run}/body/{limb}/run_card.json",
    log:
        "results/{run}/logs/body/{limb}.log",
    benchmark:
        "results/{run}/benchmarks/body/{limb}.tsv"
    conda:
        "../../environment.yml"
    threads: 1
    params:
        seed=settings["seed"],
        folder=subpath(output.model, parent=True),
    shell:
        "python -m anthro.body.build --body {wildcards.limb} --seed {params.seed} --out {params.folder} > {log} 2>&1"
