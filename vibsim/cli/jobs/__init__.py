"""The jobs of the workflow, usable by hand."""
