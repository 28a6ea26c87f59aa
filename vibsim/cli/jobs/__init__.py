"""The jobs of the workflow; a user can also call them directly."""
