"""What the checks of an experiment measured, what was expected, and whether they agree."""
