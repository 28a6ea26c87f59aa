"""Read tables and matrices that an experiment file names."""
