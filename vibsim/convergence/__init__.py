"""Whether any ladder of levels converges: arrays in, facts out; knows no model, scheme, experiment, file or word."""
