"""The engine: from (model, scheme, numbers) to trajectories."""

from vibsim.engine.trajectories import LANES, Trajectories, integrate, lane_for

__all__ = ["LANES", "Trajectories", "integrate", "lane_for"]
