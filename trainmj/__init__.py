"""Train collisions on a straight track, computed with MuJoCo.

::

    import trainmj

    result = trainmj.run("b_type", empty_stroke_mm=35)
    print(trainmj.summarise(result).TS_mm)

Everything public is listed here; a name's module is imported when the name is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trainmj.errors import EngineError, InputError, OutputError, TrainmjError

if TYPE_CHECKING:
    from trainmj.assessment import Assessment as Assessment
    from trainmj.assessment import Standard as Standard
    from trainmj.assessment import assess as assess
    from trainmj.assessment import load_assessment as load_assessment
    from trainmj.cases.reader import read_table as read_table
    from trainmj.cases.table import run_cases as run_cases
    from trainmj.cli.report import write_report as write_report
    from trainmj.collision.bracket import bracket as bracket
    from trainmj.collision.channels import channels as channels
    from trainmj.collision.convergence import Convergence as Convergence
    from trainmj.collision.convergence import converge as converge
    from trainmj.collision.kernel import installed as installed
    from trainmj.collision.lineup import line_up as line_up
    from trainmj.collision.margin import Margin as Margin
    from trainmj.collision.margin import margins as margins
    from trainmj.collision.repeated import Repeated as Repeated
    from trainmj.collision.repeated import repeated as repeated
    from trainmj.collision.result import Result as Result
    from trainmj.collision.saved import load_result as load_result
    from trainmj.collision.simulation import run as run
    from trainmj.collision.status import Status as Status
    from trainmj.collision.summary import Summary as Summary
    from trainmj.collision.summary import summarise as summarise
    from trainmj.comparison import Comparison as Comparison
    from trainmj.comparison import compare as compare
    from trainmj.identification import Found as Found
    from trainmj.identification import Identification as Identification
    from trainmj.identification import identify as identify
    from trainmj.identification import load_targets as load_targets
    from trainmj.identification import targets_of as targets_of
    from trainmj.reliability import Reliability as Reliability
    from trainmj.reliability import ReliabilityResult as ReliabilityResult
    from trainmj.reliability import load_reliability as load_reliability
    from trainmj.reliability import reliability_of as reliability_of
    from trainmj.reliability import run_reliability as run_reliability
    from trainmj.reliability import scenario_of_draw as scenario_of_draw
    from trainmj.scenario import Scenario as Scenario
    from trainmj.scenario import load as load
    from trainmj.scenario import save as save
    from trainmj.study import Study as Study
    from trainmj.study import StudyResult as StudyResult
    from trainmj.study import load_study as load_study
    from trainmj.study import run_study as run_study
    from trainmj.study import study_of as study_of
    from trainmj.sweep import Sweep as Sweep
    from trainmj.sweep import SweepResult as SweepResult
    from trainmj.sweep import grid_of as grid_of
    from trainmj.sweep import load_sweep as load_sweep
    from trainmj.sweep import run_sweep as run_sweep
    from trainmj.sweep import sweep_of as sweep_of
    from trainmj.verification.suite import Verification as Verification
    from trainmj.verification.suite import verify as verify

_HOMES = {
    "assessment": "Assessment Standard assess load_assessment",
    "cases.reader": "read_table",
    "cases.table": "run_cases",
    "cli.report": "write_report",
    "collision.bracket": "bracket",
    "collision.channels": "channels",
    "collision.convergence": "Convergence converge",
    "collision.kernel": "installed",
    "collision.lineup": "line_up",
    "collision.margin": "Margin margins",
    "collision.repeated": "Repeated repeated",
    "collision.result": "Result",
    "collision.saved": "load_result",
    "collision.simulation": "run",
    "collision.status": "Status",
    "collision.summary": "Summary summarise",
    "comparison": "Comparison compare",
    "identification": "Found Identification identify load_targets targets_of",
    "reliability": "Reliability ReliabilityResult load_reliability reliability_of run_reliability scenario_of_draw",
    "scenario": "Scenario load save",
    "study": "Study StudyResult load_study run_study study_of",
    "sweep": "Sweep SweepResult grid_of load_sweep run_sweep sweep_of",
    "verification.suite": "Verification verify",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}

__all__ = ["EngineError", "InputError", "OutputError", "TrainmjError", *_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"trainmj.{_HOME[name]}"), name)
    raise AttributeError(f"module 'trainmj' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
