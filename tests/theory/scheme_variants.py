"""Every scheme of the registry with its options, for tests that are parametrised over them."""

import pytest

from vibsim.schemes import FIXED_STEP


def _variants():
    """Yield every scheme with its defaults, and with every other choice of each of its options."""
    for kind, scheme in FIXED_STEP.items():
        defaults = scheme.defaults()
        yield pytest.param(scheme, defaults, id=kind)
        for option in scheme.options:
            if hasattr(option, "choices"):
                others = option.choices[1:]
            elif hasattr(option, "least"):
                others = (option.least, 0.5 * (option.default + option.most))
            else:
                others = (True,)
            for other in others:
                yield pytest.param(
                    scheme, {**defaults, option.name: other}, id=f"{kind}-{option.name}-{other}"
                )


VARIANTS = list(_variants())
