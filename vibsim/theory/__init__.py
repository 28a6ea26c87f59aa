"""What theory predicts of a scheme, from its own step on the linear problem ``u'' + w^2 u = 0``."""

from vibsim.theory.linear import stability_limit

__all__ = ["stability_limit"]
