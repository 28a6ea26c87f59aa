"""``vibsim run``: run experiment files and show their verdicts."""
