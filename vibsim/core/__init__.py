"""What every room shares: errors, vocabulary, labelled arrays, the netCDF door, the private cache."""
