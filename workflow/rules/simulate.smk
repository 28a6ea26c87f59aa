# Levels: one job makes several cheap levels, or one file of a level. It keeps files that are intact and up to date.
for simulation in names.simulations:

    rule:
        name:
            simulation.rule
        output:
            update(simulation.paths),
        log:
            simulation.log,
        benchmark:
            simulation.benchmark
        group:
            simulation.group
        threads: simulation.threads
        resources:
            mem_mb=names.memory(simulation.megabytes),
            runtime=names.runtime(simulation.minutes),
            disk_mb=simulation.disk,
        params:
            digest=simulation.digest,
            levels=simulation.levels,
            shard=simulation.shard,
            file=simulation.file,
            given=names.setting_flags,
            flags=names.level_flags,
        shell:
            'exec > {log:q} 2>&1; cd / && exec vibsim simulate {params.file:q} {params.given:q} --level {params.levels:q} --shard {params.shard:q} --results "$OLDPWD" --threads {threads:q} --digest {params.digest:q} {params.flags}'
