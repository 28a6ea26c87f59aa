"""What several models have in common: scales, exact solutions, events, tables."""
