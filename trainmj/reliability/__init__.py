"""Reliability: how likely limits are passed when a train is built within its tolerances."""

from trainmj.reliability.found import ReliabilityResult
from trainmj.reliability.plan import Reliability, load_reliability, reliability_of
from trainmj.reliability.run import run_reliability, scenario_of_draw

__all__ = [
    "Reliability",
    "ReliabilityResult",
    "load_reliability",
    "reliability_of",
    "run_reliability",
    "scenario_of_draw",
]
