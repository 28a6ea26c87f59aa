"""The figure that shows the result that decided a check."""
