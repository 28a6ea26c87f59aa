"""From the bytes of a file to plain data that remembers its lines."""
