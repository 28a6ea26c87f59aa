"""Read the bytes of a file as plain data with line numbers."""
