"""Parameter sweeps: keys, values, points, and the numbers of any range of members."""
