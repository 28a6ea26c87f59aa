"""The experiment file as it is written: one class per section, and the JSON Schema of them."""
