"""The ladder of any solver: from what a user has (numbers, arrays, xarray objects) to a verdict in words."""
