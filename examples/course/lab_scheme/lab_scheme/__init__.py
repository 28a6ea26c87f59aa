"""The scheme of the last lab sheet."""
