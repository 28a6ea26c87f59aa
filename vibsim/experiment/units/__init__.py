"""Numbers with units, and runs in characteristic units."""
