"""A study of the ladder of any solver: from numbers, arrays or xarray objects to a verdict in words."""
