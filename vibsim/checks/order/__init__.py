"""The check ``converges``: the order of convergence that is expected, observed and believed."""
