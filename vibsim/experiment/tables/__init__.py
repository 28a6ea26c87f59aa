"""Tables beside an experiment file."""
