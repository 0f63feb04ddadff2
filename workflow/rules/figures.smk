# A rule for each figure of the registry: its label, caption and needs differ, the rest is one.

for FIGURE in registry.FIGURES:

    rule:
        name:
            f"figure_{FIGURE}"
        input:
            code=figure_sources(FIGURE),
            needs=needs_of(FIGURE),
        output:
            report(
                figure_file(FIGURE),
                caption=f"../report/{FIGURE}.rst",
                category=registry.FIGURES[FIGURE].paper,
                labels={"figure": figure_told(FIGURE)["label"]},
            ),
        log:
            f"results/{{run}}/logs/figures/{FIGURE}.log",
        benchmark:
            f"results/{{run}}/benchmarks/figures/{FIGURE}.tsv"
        conda:
            "../../environment.yml"
        threads: 1
        params:
            module=figure_module(FIGURE),
            flags=film_flags(FIGURE),
        shell:
            "python -m {params.module} --run results/{wildcards.run} {params.flags} --out {output} > {log} 2>&1"
