"""Sweeps: many cases of a scenario, each kept as it ends."""

from trainmj.sweep.plan import Sweep, grid_of, load_sweep, sweep_of
from trainmj.sweep.run import SweepResult, run_sweep

__all__ = ["Sweep", "SweepResult", "grid_of", "load_sweep", "run_sweep", "sweep_of"]
