"""Rules that a well-formed experiment must satisfy, by section."""
