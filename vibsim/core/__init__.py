"""Shared by all packages: errors, vocabulary, labelled arrays, access to the netCDF library, the private cache."""
