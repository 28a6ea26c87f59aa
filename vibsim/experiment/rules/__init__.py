"""What an experiment must be besides well-formed, section by section."""
