# What a job is asked for, as a file: it changes, and its job is rerun, only when its own content changes.


rule spec:
    output:
        "results/{run}/specs/{job}.json",
    log:
        "results/{run}/logs/specs/{job}.log",
    localrule: True
    conda:
        "../../environment.yml"
    params:
        content=content_of,
    shell:
        "python -m anthro.config --write {output} --spec {params.content:q} > {log} 2>&1"
