"""The report of one experiment, and the index over all of them."""
