"""The heat equation u_t = kappa u_xx on 0 < x < 1 by the Crank-Nicolson scheme, with dt = dx.

    python heat.py --cells 16 --kappa 0.1 --out heat.nc

u is 0 at both ends and sin(pi x) at t = 0. The file has T(x, t) up to t = 1 and the flux at x = 0 at the end.
"""

from __future__ import annotations

import argparse

import numpy as np
import xarray


def solve(cells: int, kappa: float) -> xarray.Dataset:
    """Return temperature and flux on a grid of so many cells."""
    h = 1.0 / cells
    x = t = np.linspace(0.0, 1.0, cells + 1)
    second = np.diag(np.full(cells - 1, -2.0)) + np.eye(cells - 1, k=1) + np.eye(cells - 1, k=-1)
    half_step = 0.5 * h * kappa * second / h**2
    step = np.linalg.solve(np.eye(cells - 1) - half_step, np.eye(cells - 1) + half_step)
    temperature = np.zeros((cells + 1, cells + 1))
    temperature[:, 0] = np.sin(np.pi * x)
    for n in range(cells):
        temperature[1:-1, n + 1] = step @ temperature[1:-1, n]
    flux = kappa * (4.0 * temperature[1, -1] - temperature[2, -1]) / (2.0 * h)
    return xarray.Dataset(
        {"T": (("x", "t"), temperature, {"units": "K"}), "flux": flux}, {"x": x, "t": t}
    )


def main() -> None:
    """Write the solution to a netCDF file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, required=True)
    parser.add_argument("--kappa", type=float, default=0.1)
    parser.add_argument("--out", required=True)
    options = parser.parse_args()
    solve(options.cells, options.kappa).to_netcdf(options.out)


if __name__ == "__main__":
    main()
