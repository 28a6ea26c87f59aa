"""Other people's solvers: read their files, run them level by level, and judge the levels.

`level_tables` and `level_files` read the studies of `vibsim judge`. In an experiment with a solver, `run` makes a
level, `level_output` reads and stores it, and `analysis` and `verdicts` compare all levels.
"""
