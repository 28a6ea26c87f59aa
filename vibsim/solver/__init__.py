"""What solvers of other people computed: reading their files, running them level by level, and judging the levels.

`level_tables` and `level_files` read studies of `vibsim judge`, `run` makes a level of an experiment with a solver,
`level_output` is what it wrote, and `analysis` and `verdicts` compare all levels.
"""
