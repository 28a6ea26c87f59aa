# The page over all experiments: those chosen, and those that were found among the results. It takes no time, and is made
# where the workflow runs.
localrules:
    index,


rule index:
    input:
        names.indexed,
    output:
        "index.html",
        "summary.csv",
    log:
        ".vibsim/logs/index.log",
    benchmark:
        ".vibsim/benchmarks/index.tsv"
    params:
        digest=names.index_digest,
    shell:
        'exec > {log:q} 2>&1; cd / && exec vibsim report --results "$OLDPWD"'


# One page, its figures and its tables.
rule report:
    input:
        "{experiment}/convergence.nc",
        "{experiment}/summary.json",
    output:
        "{experiment}/report.html",
        directory("{experiment}/figures"),
        directory("{experiment}/tables"),
    log:
        "{experiment}/logs/report.log",
    benchmark:
        "{experiment}/benchmarks/report.tsv"
    resources:
        mem_mb=names.memory(names.page_memory),
    params:
        digest=names.report_digest,
        file=names.file,
        given=names.given,
    shell:
        'exec > {log:q} 2>&1; cd / && exec vibsim report {params.file:q} {params.given:q} --results "$OLDPWD" --discard --digest {params.digest:q}'
