"""``vibsim run``: from experiment files to verdicts."""
