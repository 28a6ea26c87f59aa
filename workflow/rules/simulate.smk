# One level of one experiment: every scheme and every member.
rule simulate:
    output:
        "{experiment}/level_{level}.nc",
    log:
        "{experiment}/logs/level_{level}.log",
    benchmark:
        "{experiment}/benchmarks/level_{level}.tsv"
    params:
        digest=names.shard_digest,
        file=names.file,
    shell:
        "vibsim simulate {params.file:q} --level {wildcards.level} --out {output:q} --results . --digest {params.digest} > {log:q} 2>&1"


# The same for a range of the members of a sweep.
rule simulate_shard:
    output:
        "{experiment}/level_{level}/shard_{shard}.nc",
    log:
        "{experiment}/logs/level_{level}_shard_{shard}.log",
    benchmark:
        "{experiment}/benchmarks/level_{level}_shard_{shard}.tsv"
    params:
        digest=names.shard_digest,
        file=names.file,
    shell:
        "vibsim simulate {params.file:q} --level {wildcards.level} --shard {wildcards.shard} --out {output:q} --results . --digest {params.digest} > {log:q} 2>&1"
