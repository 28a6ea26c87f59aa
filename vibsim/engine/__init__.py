"""The engine: from (model, scheme, numbers) to trajectories."""

from vibsim.engine.kernel import LANES
from vibsim.engine.results import EventTimes, Extrema, Gathered, Series, Trajectories
from vibsim.engine.trajectories import energies, extrema_of, integrate, lane_for, observed

__all__ = [
    "LANES",
    "EventTimes",
    "Extrema",
    "Gathered",
    "Series",
    "Trajectories",
    "energies",
    "extrema_of",
    "integrate",
    "lane_for",
    "observed",
]
