# Extrapolate the solution of one experiment over all its levels (`output: best`).
rule extrapolate:
    input:
        names.shards,
    output:
        "{experiment}/best.nc",
    log:
        "{experiment}/logs/extrapolate.log",
    benchmark:
        "{experiment}/benchmarks/extrapolate.tsv"
    wildcard_constraints:
        experiment=names.best_pattern,
    localrule: names.finishes_here
    resources:
        mem_mb=names.analysis_memory,
        runtime=names.analysis_minutes,
        disk_mb=names.best_disk,
    params:
        digest=names.extrapolation_digest,
        file=names.file,
        given=names.setting_flags,
    shell:
        'exec > {log:q} 2>&1; cd / && exec vibsim extrapolate {params.file:q} {params.given:q} --results "$OLDPWD" --discard --digest {params.digest:q}'
