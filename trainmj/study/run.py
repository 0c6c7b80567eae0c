"""Run a study: each step from those before it, and only what has changed."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trainmj.errors import close_match
from trainmj.files.folder import held
from trainmj.files.parts import Part
from trainmj.files.plain import finite
from trainmj.files.problems import Problem
from trainmj.output.style import Format, Width
from trainmj.scenario import to_yaml
from trainmj.study import choice, fronts, steps, surrogates
from trainmj.study.folder import Folder, Output, Step
from trainmj.study.plan import Study, load_study
from trainmj.study.simulator import FILE, Simulator

if TYPE_CHECKING:
    import pandas as pd

SUMMARY = "summary.json"
STEPS = (
    "as it stands",
    "design",
    "simulations",
    "correlation",
    "surrogates",
    "front on the surrogates",
    "front on the simulator",
    "fronts compared",
    "weights",
    "decision",
    "check",
)
"""The steps, in the order of the numbers of their files, from 00."""


@dataclass(frozen=True)
class StudyResult:
    """A finished study.

    Attributes:
        study: what was asked.
        folder: where its files are.
        tables: by file name without ending.
        summary: what summary.json says, by step.
        computed: steps done now; the others were there.
        simulated: collisions computed now.
    """

    study: Study
    folder: Path
    tables: Mapping[str, pd.DataFrame]
    summary: Mapping[str, Any]
    computed: tuple[str, ...]
    simulated: int


class Watch:
    """Told how a study gets on; this one says nothing."""

    def begin(self, step: str) -> None:
        """A step begins."""

    def simulated(self, count: int) -> None:
        """So many collisions have been computed in all."""

    def done(self, step: Step) -> None:
        """A step is done."""


def run_study(
    study: Study | str | Path,
    folder: str | Path,
    threads: int = 0,
    watch: Watch | None = None,
    figures: Sequence[Format] = ("png",),
    figure_width: Width = "page",
) -> StudyResult:
    """Run a study from its design to the chosen and verified design.

    Each step leaves numbered tables and figures in the folder. A step whose inputs and files are as they were is not
    done again, and no collision is computed twice; whatever stops a study, the next run goes on from there.

    Args:
        study: a study, a study file, or the name of a shipped one.
        folder: made if it is not there.
        threads: native threads; 0 for all cores. The numbers do not depend on it.
        watch: told how it gets on.
        figures: formats to draw them in (png, svg, pdf); none saves time, for they take longer than most steps.
        figure_width: of the figures, that of a column or of the page of a journal.

    Raises:
        InputError: if the file breaks a rule, too few cases of the design can be computed, a surrogate cannot be
            fitted, or no design keeps the constraints.
        OutputError: if a file cannot be written or another process writes there; finished steps and simulations are
            kept.
    """
    study = study if isinstance(study, Study) else load_study(study)
    watch = watch or Watch()
    with held(folder) as path, Simulator(path / FILE, study, threads, watch.simulated) as simulator:
        files = Folder(path, figures, figure_width)
        _steps(study, files, simulator, watch)
        files.finish()
        summary = _summary(study, files.steps)
        files.write(SUMMARY, json.dumps(summary, indent=2).encode())
        tables = {name: table for step in files.steps for name, table in step.tables.items()}
        computed = tuple(step.name for step in files.steps if step.computed)
        return StudyResult(study, files.path, tables, summary, computed, simulator.computed)


def _steps(study: Study, files: Folder, simulator: Simulator, watch: Watch) -> None:
    """All steps, each with what it depends on."""
    spec = study.spec
    names = [_plain(study.responses), study.heads, _plain(study.space.factors)]
    limits = [spec.objectives, _plain(spec.constraints), _plain(spec.optimiser)]

    def step(name: str, inputs: list[Any], make: Callable[[], Output]) -> Step:
        watch.begin(name)
        done = files.step(name, inputs, make)
        watch.done(done)
        return done

    stands = step("as it stands", study.identity, lambda: steps.baseline(study, simulator))
    _check_columns(study, stands.table)
    design = step("design", [names, _plain(spec.design), _given(study)], lambda: steps.design(study))
    simulations = step(
        "simulations", [names, study.identity, design.digest], lambda: steps.simulations(study, design.table, simulator)
    )
    data = [names, simulations.digest]
    step("correlation", [data, _plain(spec.correlation)], lambda: steps.correlation(study, simulations.table))
    models = [data, _plain(spec.surrogates)]
    step(
        "surrogates",
        [models, _plain(spec.cross_validation), _plain(spec.constraints)],
        lambda: surrogates.surrogates(study, simulations.table),
    )
    found: dict[str, Step] = {}
    if spec.optimiser.on != "simulator":
        found["surrogate"] = step(
            "front on the surrogates", [models, limits], lambda: fronts.on_surrogates(study, simulations.table)
        )
    if spec.optimiser.on != "surrogate":
        found["simulator"] = step(
            "front on the simulator", [names, study.identity, limits], lambda: fronts.on_simulator(study, simulator)
        )
    if len(found) == 2:
        both = [step.digest for step in found.values()]
        step(
            "fronts compared",
            [names, study.identity, limits, both],
            lambda: fronts.compared(study, found["surrogate"].table, found["simulator"].table, simulator),
        )
    front = found[spec.decision.front] if spec.decision.front else next(iter(found.values()))
    goals = [names, spec.objectives, front.digest]
    weights = step(
        "weights",
        [goals, _plain(spec.weights), simulations.digest],
        lambda: choice.weights(study, simulations.table, front.table),
    )
    decision = step(
        "decision",
        [goals, _plain(spec.decision), weights.digest],
        lambda: choice.decision(study, front.table, weights.table),
    )
    step(
        "check",
        [names, study.identity, _plain(spec.check), _plain(spec.constraints), decision.digest, stands.digest],
        lambda: choice.check(study, decision.table, stands.table, simulator),
    )


def _given(study: Study) -> str:
    """Content of the file of a given design; empty if there is none to be read."""
    name = study.spec.design.file
    file = study.source.folder / name if name else None
    return file.read_text(encoding="utf-8", errors="replace") if file and file.is_file() else ""


def _check_columns(study: Study, stands: pd.DataFrame) -> None:
    """Refuse a response that is no column of numbers, now that the columns are known.

    Raises:
        InputError: naming each with its place.
    """
    columns = [name for name in stands["response"] if name not in ("status", "reason")]
    problems = [
        Problem(("responses", r.name), f"no response is called {r.column!r}{close_match(r.column, columns)}")
        for r in study.responses
        if r.column not in columns
    ]
    study.source.refuse(problems)


def _plain(value: Any) -> Any:
    """Parts and frozen values as JSON holds them."""
    if isinstance(value, Part):
        return value.model_dump()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return {key: str(item) for key, item in vars(value).items()} if hasattr(value, "__dict__") else value


def _summary(study: Study, done: list[Step]) -> dict[str, Any]:
    """What was asked, in full, and the facts of all steps, without what JSON has no number for."""
    from trainmj.collision.identity import identity

    factors = {f.name: {"unit": f.unit, "lower": f.lower, "upper": f.upper} for f in study.space.factors}
    about = {
        "title": study.title,
        "factors": factors,
        "objectives": dict(study.spec.objectives),
        "constraints": [limit.text for limit in study.limits],
        "study": dict(study.source.values, scenario="scenario.yaml"),
        "scenario": to_yaml(study.scenario),
        "versions": identity(),
    }
    result: dict[str, Any] = finite(about | {step.name.replace(" ", "_"): dict(step.facts) for step in done})
    return result
