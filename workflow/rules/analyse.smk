# Compare all levels of one experiment and decide its checks.
rule analyse:
    input:
        names.shards,
    output:
        "{experiment}/convergence.nc",
        "{experiment}/summary.json",
    log:
        "{experiment}/logs/analyse.log",
    benchmark:
        "{experiment}/benchmarks/analyse.tsv"
    group:
        names.analysis_group
    localrule: names.finishes_here
    threads: names.analysis_threads
    resources:
        mem_mb=names.analysis_memory,
        runtime=names.analysis_minutes,
        disk_mb=names.analysis_disk,
    params:
        digest=names.analysis_digest,
        file=names.file,
        given=names.setting_flags,
    shell:
        'exec > {log:q} 2>&1; cd / && exec vibsim analyse {params.file:q} {params.given:q} --results "$OLDPWD" --discard --threads {threads:q} --digest {params.digest:q}'
