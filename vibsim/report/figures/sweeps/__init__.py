"""The figures of a sweep: curves, maps and members over the swept values."""
