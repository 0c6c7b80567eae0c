"""Scenario files: what is collided, checked before anything runs."""

from trainmj.scenario.files import from_yaml, load, save, scenario_given, schema, shipped, to_yaml
from trainmj.scenario.scenario import Scenario
from trainmj.scenario.trains import RIGID_WALL

__all__ = ["RIGID_WALL", "Scenario", "from_yaml", "load", "save", "scenario_given", "schema", "shipped", "to_yaml"]
