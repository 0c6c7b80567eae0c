"""Run a study step by step; steps whose inputs have not changed are taken from the folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from trainmj.cases.store import KEY, Store
from trainmj.errors import InputError
from trainmj.files.arguments import given
from trainmj.files.folder import filling, remove_own
from trainmj.files.sealed import sealed
from trainmj.files.shown import Shown
from trainmj.files.written import remove
from trainmj.output.style import Format, Width, formats_given
from trainmj.study import choice, fronts, steps, surrogates
from trainmj.study.designs import Designs, Simulates
from trainmj.study.folder import OF_STEPS, ROBUST_FILES, Folder, Output, Step, Tables
from trainmj.study.plan import Study, load_study
from trainmj.study.robust import Sampler, held, margins, margins_in, robust_of
from trainmj.study.simulator import FILE, Simulator
from trainmj.study.summary import summary_of, tables_of
from trainmj.study.tables import verdict

if TYPE_CHECKING:
    import pandas as pd

V = TypeVar("V")

SUMMARY = "summary.json"
_ROBUST = "robust: "
"""Before the names of the steps of the robust search."""

_NOT_OF_STEPS = r"simulations\.sqlite(-\w+)?|(steps|summary)\.json|report\.html"
OWN = f"{OF_STEPS}|{_NOT_OF_STEPS}"
"""The files of the folder, as a pattern of their names."""


@dataclass(frozen=True)
class StudyResult(Shown):
    """A finished study.

    Attributes:
        study: what was asked.
        folder: where its files are.
        tables: by file name without ending.
        summary: what summary.json says, by step.
        computed: steps done now; the others were there.
        simulated: collisions computed now.
        changes: what had changed since the last run in this folder, input and versions, in words.
    """

    study: Study
    folder: Path
    tables: Mapping[str, pd.DataFrame]
    summary: Mapping[str, Any]
    computed: tuple[str, ...]
    simulated: int
    changes: tuple[str, ...]

    def __repr__(self) -> str:
        """Title, verdict, and where it is."""
        return f"<StudyResult {self.summary['title']}. {verdict(self.summary).text} In {self.folder}>"


class Watch:
    """Hears about the progress of a study; this one ignores it."""

    def changed(self, changes: Sequence[str]) -> None:
        """What has changed since the last run in the folder; steps that depend on it are done again."""

    def begin(self, step: str) -> None:
        """A step begins."""

    def simulated(self, count: int) -> None:
        """The number of collisions computed so far."""

    def done(self, step: Step[Any]) -> None:
        """A step is done."""


def run_study(
    study: Study | str | Path,
    folder: str | Path,
    *,
    threads: int = 0,
    fresh: bool = False,
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
        fresh: start over: remove what a study left in the folder, unless somebody has changed it.
        watch: hears about its progress.
        figures: formats to draw them in (png, svg, pdf); none saves time, for they take longer than most steps.
        figure_width: of the figures, that of a column or of the page of a journal.

    Raises:
        InputError: if the file breaks a rule, too few cases of the design can be computed, a surrogate cannot be
            fitted, or no design keeps the constraints.
        OutputError: if a file cannot be written or another process writes there; finished steps and simulations are
            kept.
    """
    study = given(study, Study, load_study)
    watch, formats = watch or Watch(), formats_given(figures)
    with filling(folder, OWN, study.files) as path:
        files = Folder(path, formats, figure_width)
        if fresh:
            files.start_over()
            remove_own(path, _NOT_OF_STEPS)
        with Store(path / FILE, KEY) as store:
            remove(path / SUMMARY)  # comes back when all steps are of one study
            simulator = Simulator(store, study, threads, watch.simulated)
            watch.changed(simulator.changes)
            chosen = _steps(study, files, simulator, watch)
            robust, failed = None, ""
            try:
                robust = _robust_steps(study, files, simulator, watch, chosen) if study.spec.robust else None
            except InputError as error:
                failed = f"in the search for robust designs: {error}"
            files.finish()
            summary = summary_of(study, files.steps, robust, failed, simulator.changes)
            files.write(SUMMARY, json.dumps(sealed(summary), indent=2).encode())
            if failed:
                raise InputError(f"{failed}; the nominal study is finished: see its summary and report")
            simulator.finish()
            store.finish()
        further = list(robust[1]) if robust else []
        tables = tables_of(files.steps) | {f"{ROBUST_FILES}{name}": of for name, of in tables_of(further).items()}
        named = [(step.name, step) for step in files.steps] + [(f"{_ROBUST}{step.name}", step) for step in further]
        computed = tuple(name for name, step in named if step.seconds is not None)
        return StudyResult(study, path, tables, summary, computed, simulator.computed, tuple(simulator.changes))


def _robust_steps(
    study: Study, files: Folder, simulator: Simulator, watch: Watch, nominal: Step[choice.Choice]
) -> tuple[Study, list[Step[Any]]]:
    """The steps of the search for designs that hold under tolerances: of which study, and what was done."""
    robust = robust_of(study)
    sampler, part = Sampler(robust, simulator), files.part(ROBUST_FILES)
    chosen = _steps(robust.study, part, sampler, watch, _ROBUST)
    watch.begin("how the designs hold")
    scenarios = [{case: scenario.counted() for case, scenario in study.scenarios.items()}, study.targets]
    done = part.step(
        "held",
        [scenarios, sampler.asks, study.spec.check.model_dump(), nominal.digest, chosen.digest],
        lambda: held(sampler, nominal.value(), chosen.value()),
        lambda _: None,
    )
    watch.done(done)
    return robust.study, part.steps


def _steps(study: Study, files: Folder, simulator: Simulates, watch: Watch, of: str = "") -> Step[choice.Choice]:
    """All steps, each with what it depends on; the decision is returned."""
    spec, asked = study.spec, study.spec.model_dump()
    names = [[asdict(r) for r in study.responses], [asdict(f) for f in study.space.factors]]
    limits = [spec.objectives, asked["constraints"], asked["cases"], asked["optimiser"]]
    scenarios = {case: scenario.counted() for case, scenario in study.scenarios.items()}
    scenario = [scenarios, study.targets, simulator.asks]

    def step(name: str, inputs: list[Any], make: Callable[[], Output[V]], read: Callable[[Tables], V]) -> Step[V]:
        watch.begin(f"{of}{name}")
        done = files.step(name, inputs, make, read)
        watch.done(done)
        return done

    def designs(file: str) -> Callable[[Tables], Designs]:
        return lambda tables: Designs.read(study, tables[file])

    def nothing(_: Tables) -> None:
        """Nothing depends on the step."""

    stands = step(
        "as it stands",
        scenario,
        lambda: steps.as_it_stands(study, simulator),
        lambda tables: steps.read_as_it_stands(study, tables),
    )
    design = step(
        "design",
        [names, asked["design"], study.given],
        lambda: steps.design(study),
        lambda tables: study.space.from_table(tables["01_design"]),
    )
    simulations = step(
        "simulations",
        [names, scenario, design.digest],
        lambda: steps.simulations(study, design.value(), simulator),
        designs("02_simulations"),
    )
    data = [names, simulations.digest]
    step("correlation", [data, asked["correlation"]], lambda: steps.correlation(study, simulations.value()), nothing)
    models = step(
        "surrogates",
        [data, asked["surrogates"], asked["cross_validation"], asked["constraints"], asked["quality"]],
        lambda: surrogates.surrogates(study, simulations.value()),
        lambda _: surrogates.fit_all(study, simulations.value()),
    )
    if isinstance(simulator, Sampler) and study.on_surrogates:
        sampler, nominal = simulator, study
        inner = step(
            "margins",
            [data, scenario, limits, *(asked[part] for part in ("surrogates", "weights", "decision", "check"))],
            lambda: margins(nominal, models.value(), simulations.value(), sampler),
            margins_in,
        )
        study = replace(study, margins=inner.value())
        limits = [*limits, study.margins]
    found: dict[str, Step[Designs]] = {}
    if spec.optimiser.on != "simulator":
        found["surrogate"] = step(
            "front on the surrogates",
            [data, asked["surrogates"], limits],
            lambda: fronts.on_surrogates(study, models.value()),
            designs(fronts.FILES["surrogate"]),
        )
    if spec.optimiser.on != "surrogate":
        found["simulator"] = step(
            "front on the simulator",
            [names, scenario, limits],
            lambda: fronts.on_simulator(study, simulator),
            designs(fronts.FILES["simulator"]),
        )
    if len(found) == 2:
        predicted, direct = found.values()
        step(
            "fronts compared",
            [names, scenario, limits, predicted.digest, direct.digest],
            lambda: fronts.compared(study, predicted.value(), direct.value(), simulator),
            nothing,
        )
    front = found[spec.decision.front] if spec.decision.front else next(iter(found.values()))
    goals = [names, spec.objectives, front.digest]
    weights = step(
        "weights",
        [goals, asked["weights"], simulations.digest],
        lambda: choice.weights(study, simulations.value(), front.value()),
        lambda tables: tables["08_weights"]["weight"].to_numpy(),
    )
    decision = step(
        "decision",
        [goals, asked["decision"], weights.digest],
        lambda: choice.decision(study, front.value(), weights.value()),
        lambda tables: choice.Choice.read(study, tables),
    )
    digests = [done.digest for done in (decision, stands, simulations)]
    step(
        "check",
        [goals, scenario, *(asked[part] for part in ("check", "constraints", "cases", "quality")), *digests],
        lambda: choice.check(study, decision.value(), stands.value(), simulations.value(), simulator),
        nothing,
    )
    return decision
