# The index of all experiments: the chosen ones, and others in the results folder. It is quick, so it is made where the
# workflow runs.
localrules:
    index,


rule index:
    input:
        names.indexed,
    output:
        "index.html",
        report(
            "summary.csv",
            caption="../report/summary.rst",
            category="All experiments",
            labels={"shows": "verdicts"},
        ),
    log:
        ".vibsim/logs/index.log",
    benchmark:
        ".vibsim/benchmarks/index.tsv"
    params:
        digest=names.index_digest,
    shell:
        'exec > {log:q} 2>&1; cd / && exec vibsim report --results "$OLDPWD"'


# The report of one experiment, with its figures and tables.
rule report:
    input:
        "{experiment}/convergence.nc",
        "{experiment}/summary.json",
    output:
        report(
            "{experiment}/report.html",
            caption="../report/page.rst",
            category="{experiment}",
            labels={"shows": "page"},
        ),
        report(
            directory("{experiment}/figures"),
            patterns=["{figure}.svg"],
            caption="../report/figure.rst",
            category="{experiment}",
            labels={"shows": "figure: {figure}"},
        ),
        report(
            directory("{experiment}/tables"),
            patterns=["{table}.csv"],
            caption="../report/table.rst",
            category="{experiment}",
            labels={"shows": "table: {table}"},
        ),
    log:
        "{experiment}/logs/report.log",
    benchmark:
        "{experiment}/benchmarks/report.tsv"
    group:
        names.analysis_group
    localrule: names.finishes_here
    resources:
        mem_mb=names.memory(names.page_memory),
        runtime=names.runtime(names.page_minutes),
        disk_mb=names.page_disk,
    params:
        digest=names.report_digest,
        file=names.file,
        given=names.setting_flags,
    shell:
        'exec > {log:q} 2>&1; cd / && exec vibsim report {params.file:q} {params.given:q} --results "$OLDPWD" --discard --digest {params.digest:q}'
