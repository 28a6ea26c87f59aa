"""The figure of the decisive result of a check."""
