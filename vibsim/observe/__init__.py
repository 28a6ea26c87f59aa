"""Measurements on the motion of a block of members: oscillation, energy, phase and amplitude, stiffness."""
