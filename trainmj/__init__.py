"""Train collisions on a straight track, computed with MuJoCo.

::

    import trainmj

    scenario = trainmj.load("b_type", {"empty_stroke_mm": 35})
    result = trainmj.run(scenario)
    print(trainmj.summarise(result).TS_mm)

Everything public is listed here; a name's module is imported when the name is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trainmj.errors import EngineError, InputError, OutputError, TrainmjError

if TYPE_CHECKING:
    from trainmj.chain import line_up
    from trainmj.experiment import run_cases
    from trainmj.metrics import Summary, summarise
    from trainmj.native import installed
    from trainmj.result import Result, load_result
    from trainmj.scenario import Scenario, load, save
    from trainmj.simulation import run
    from trainmj.sweep import load_plan, plan_of, read_table, run_sweep

_HOMES = {
    "line_up": "chain",
    "run_cases": "experiment",
    "Summary": "metrics",
    "summarise": "metrics",
    "installed": "native",
    "Result": "result",
    "load_result": "result",
    "Scenario": "scenario",
    "load": "scenario",
    "save": "scenario",
    "run": "simulation",
    "load_plan": "sweep",
    "plan_of": "sweep",
    "read_table": "sweep",
    "run_sweep": "sweep",
}

__all__ = [
    "EngineError",
    "InputError",
    "OutputError",
    "Result",
    "Scenario",
    "Summary",
    "TrainmjError",
    "installed",
    "line_up",
    "load",
    "load_plan",
    "load_result",
    "plan_of",
    "read_table",
    "run",
    "run_cases",
    "run_sweep",
    "save",
    "summarise",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"trainmj.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'trainmj' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
