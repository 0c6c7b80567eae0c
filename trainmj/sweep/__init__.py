"""Sweeps: many cases of a scenario, each kept as it ends."""

from trainmj.cases.reader import read_table
from trainmj.sweep.plan import Plan, load_sweep, plan_of, sweep_of
from trainmj.sweep.run import Outcome, run_sweep

__all__ = ["Outcome", "Plan", "load_sweep", "plan_of", "read_table", "run_sweep", "sweep_of"]
