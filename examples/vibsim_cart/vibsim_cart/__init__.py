"""A pendulum on a cart, and Ralston's method: an example of a package that adds to vibsim."""
