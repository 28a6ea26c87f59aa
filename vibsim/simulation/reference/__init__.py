"""Reference solutions by piecewise collocation, for models without a known exact solution."""
