"""Quantities, numbers and solutions of an experiment compared between its levels."""
