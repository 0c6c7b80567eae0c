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
    from trainmj.cases.table import run_cases
    from trainmj.collision.kernel import installed
    from trainmj.collision.lineup import line_up
    from trainmj.collision.result import Result, load_result
    from trainmj.collision.simulation import run
    from trainmj.collision.summary import Summary, summarise
    from trainmj.identification import identify, load_targets, targets_of
    from trainmj.scenario import Scenario, load, save
    from trainmj.study import Study, StudyResult, load_study, run_study, study_of
    from trainmj.sweep import Sweep, SweepResult, grid_of, load_sweep, read_table, run_sweep, sweep_of

_HOMES = {
    "line_up": "collision.lineup",
    "run_cases": "cases.table",
    "Summary": "collision.summary",
    "summarise": "collision.summary",
    "installed": "collision.kernel",
    "Result": "collision.result",
    "load_result": "collision.result",
    "Scenario": "scenario",
    "load": "scenario",
    "save": "scenario",
    "run": "collision.simulation",
    "Sweep": "sweep",
    "SweepResult": "sweep",
    "grid_of": "sweep",
    "load_sweep": "sweep",
    "read_table": "sweep",
    "run_sweep": "sweep",
    "sweep_of": "sweep",
    "Study": "study",
    "StudyResult": "study",
    "load_study": "study",
    "run_study": "study",
    "study_of": "study",
    "identify": "identification",
    "load_targets": "identification",
    "targets_of": "identification",
}

__all__ = [
    "EngineError",
    "InputError",
    "OutputError",
    "Result",
    "Scenario",
    "Study",
    "StudyResult",
    "Summary",
    "Sweep",
    "SweepResult",
    "TrainmjError",
    "grid_of",
    "identify",
    "installed",
    "line_up",
    "load",
    "load_result",
    "load_study",
    "load_sweep",
    "load_targets",
    "read_table",
    "run",
    "run_cases",
    "run_study",
    "run_sweep",
    "save",
    "study_of",
    "summarise",
    "sweep_of",
    "targets_of",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"trainmj.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'trainmj' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
