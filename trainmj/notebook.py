"""What a notebook shows of things by themselves: the tables of the report, and the figures that the commands write.

:class:`trainmj.files.shown.Shown` leads here; the classes themselves are in rooms below those of their tables.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from trainmj.errors import InputError, close_match
from trainmj.output.cell import Cell
from trainmj.output.style import WIDTHS, Width, encode, styled
from trainmj.output.table import Table, failed, worded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from trainmj.assessment import Assessment, Standard
    from trainmj.collision.convergence import Convergence
    from trainmj.collision.result import Result
    from trainmj.collision.summary import Summary
    from trainmj.comparison.found import Comparison
    from trainmj.identification import Found, Identification
    from trainmj.reliability import Reliability, ReliabilityResult
    from trainmj.scenario import Scenario
    from trainmj.study import Study, StudyResult
    from trainmj.sweep import Sweep, SweepResult
    from trainmj.verification.suite import Verification

_PIXELS = 96 / 25.4  # of a screen for each millimetre of a figure
_MOST_UNFOLDED = 12  # rows of a table that is read second


def html_of(thing: Any) -> str:
    """Markup of a thing for a notebook: a title and its tables."""
    cell: Cell = _of_its_kind(_CELLS, thing)(thing)
    return cell.html()


def figure_of(thing: Any, name: str = "", width: str = "page") -> Figure:
    """A figure of a thing by the name of its file; the first one if none is named.

    Raises:
        InputError: if there is no such figure, or width.
    """
    if width not in WIDTHS:
        raise InputError(f"width: {width!r} is no width of a figure; known: {', '.join(WIDTHS)}")
    there: Drawings = _of_its_kind(_FIGURES, thing)(thing, width)
    name = name or next(iter(there))
    if name not in there:
        raise InputError(f"{name}: there is no such figure here{close_match(name, there)}")
    with styled(width):
        picture = there[name]()
    if picture is None:
        raise InputError(f"{name}: there is nothing to draw in this figure here")
    wide, high = (25.4 * _PIXELS * inches for inches in picture.get_size_inches())
    shown: Any = picture  # made without pyplot, it would be shown as text
    shown._repr_png_ = lambda: (encode(picture, "png"), {"width": round(wide), "height": round(high)})
    return picture


def _of_its_kind(known: dict[str, Callable[..., Any]], thing: Any) -> Callable[..., Any]:
    """What is known of the class of a thing, or of the nearest one that it builds on."""
    return next(known[kind.__name__] for kind in inspect.getmro(type(thing)) if kind.__name__ in known)


def _cell(title: str, subtitle: str, tables: Iterable[Table | None], said: Iterable[str] = ()) -> Cell:
    cell = Cell(title, subtitle)
    cell.text(*said)
    for n, table in enumerate(table for table in tables if table is not None and table.rows):
        cell.table(table, folded=n > 0 and bool(table.title) and len(table.rows) > _MOST_UNFOLDED)
    return cell


def _scenario(scenario: Scenario) -> Cell:
    from trainmj.collision.lineup import line_up
    from trainmj.single import devices, tables

    try:
        chain = line_up(scenario)
    except InputError as error:
        cell = Cell(scenario.heading, scenario.subject)
        cell.facts({"cannot be computed": failed(str(error))})
        return cell
    values = [(name, ", ".join(dict.fromkeys(map(str, scenario.locate(name))))) for name in scenario.parameters]
    parameters = Table(worded("Parameter", "value"), values)
    tables_shown = (parameters, tables.vehicles_of(chain), tables.interfaces_of(chain), devices.table(scenario, chain))
    return _cell(scenario.heading, scenario.subject, tables_shown)


def _result(result: Result) -> Cell:
    from trainmj.collision.summary import summarise
    from trainmj.single import tables

    summary = summarise(result)
    cell = _summary(summary)
    cell.title, cell.subtitle = result.scenario.heading, result.scenario.subject
    for table in tables.vehicles(result.chain, summary):
        cell.table(table if table.title else Table(table.columns, table.rows, "Vehicles", table.note), folded=True)
    cell.table(tables.energy(summary))
    return cell


def _summary(summary: Summary) -> Cell:
    from trainmj.collision.quantities import TRAIN
    from trainmj.collision.verdict import verdict
    from trainmj.single import tables

    cell = Cell("One collision")
    if summary.not_valid:
        cell.facts({"NOT VALID": failed(f"after {summary.valid_until_s:.4g} s: {tables.why_not_valid(summary)}")})
    there = [(q, summary.values[q.name]) for q in TRAIN if q.name in summary.values]
    numbers = {q.heading: f"{q.text(value)} {q.unit}".rstrip() for q, value in there}
    status = f"{summary.status}, {summary.duration_s:.3f} s simulated"
    cell.facts({"Verdict": verdict(summary), "Status": status, **numbers})
    for table in (tables.limits(summary.limits).marked(summary.not_valid),) if summary.limits else ():
        cell.table(table)
    cell.table(tables.interfaces(summary))
    cell.notes(summary.remarks) if summary.remarks else None
    return cell


def _convergence(found: Convergence) -> Cell:
    from trainmj.single import tables

    settled = f"{'Settled' if found.settled else 'Not settled'} at {found.step_ms[-1]:g} ms"
    return _cell(settled, "", tables.convergence(found))


def _sweep(sweep: Sweep) -> Cell:
    from trainmj.sweep import screen

    return _cell(f"Sweep: {len(sweep)} cases", sweep.scenario.heading, screen.tables_of_plan(sweep))


def _sweep_result(result: SweepResult) -> Cell:
    from trainmj.sweep import screen

    said = [result.verdict.text, *screen.said_of_result(result)]
    return _cell(f"Sweep: {result.cases} cases", "", screen.tables_of_result(result), said)


def _study(study: Study) -> Cell:
    from trainmj.study import tables

    shown = [tables.cases_of(study)] if study.spec.cases else []
    return _cell(study.title, study.scenario.subject, [*shown, tables.factors_of(study), tables.responses_of(study)])


def _study_result(result: StudyResult) -> Cell:
    from trainmj.study import tables

    summary = result.summary
    cell = Cell(summary["title"], str(result.folder))
    cell.facts({"Verdict": tables.verdict(summary), **tables.design(summary)})
    for table in (tables.check(summary), tables.decision(summary), tables.surrogates(summary)):
        cell.table(table)
    if summary["remarks"]:
        cell.table(tables.remarks(summary))
    return cell


def _identification(plan: Identification) -> Cell:
    from trainmj.identification import tables

    return _cell(plan.title, tables.size(plan), (tables.sought(plan), tables.wanted(plan)))


def _found(found: Found) -> Cell:
    from trainmj.identification import tables

    cell = Cell(found.plan.title, str(found.folder))
    cell.facts({"Verdict": tables.verdict(found), **tables.constraints(found)})
    for table in (tables.parameters(found), *(tables.fit(found, role) for role in found.samples)):
        cell.table(table)
    return cell


def _standard(standard: Standard) -> Cell:
    from trainmj.assessment import tables

    return _cell(standard.spec.title, standard.spec.edition, [tables.asked(standard)])


def _assessment(found: Assessment) -> Cell:
    from trainmj.assessment import tables

    cell = Cell(found.title, f"Train: that of {found.train.heading}")
    cell.facts({"Verdict": tables.verdict(found)})
    if found.failed:
        cell.notes(found.failed)
    for made in (tables.criteria, tables.cases, tables.not_computed):
        if (table := made(found)).rows:
            cell.table(table)
    return cell


def _reliability(plan: Reliability) -> Cell:
    from trainmj.reliability import tables

    return _cell(plan.title, tables.size(plan), [tables.tolerances(plan)])


def _reliability_result(result: ReliabilityResult) -> Cell:
    from trainmj.reliability import screen, tables

    made = (tables.probabilities, tables.causes, tables.rare, tables.indices, tables.quantiles)
    said = [tables.verdict(result).text, *screen.remarks(result)]
    return _cell(result.plan.title, "", (of(result) for of in made), said)


def _verification(found: Verification) -> Cell:
    from trainmj.verification.page import table_of

    tables = (table_of(checks, group.title) for group, checks in found.groups)
    return _cell("Verification", found.verdict.text, tables)


def _comparison(found: Comparison) -> Cell:
    from trainmj.comparison import tables

    cell = Cell(f"{found.a.name} against {found.b.name}", "A is held against B; percentages are of B")
    cell.facts({"Verdict": tables.verdict(found)})
    cell.table(tables.rules(found))
    for title, some in tables.titled(found):
        cell.table(tables.differences(some, title, means=False))
    return cell


_CELLS: dict[str, Callable[..., Cell]] = {
    "Scenario": _scenario,
    "Result": _result,
    "Summary": _summary,
    "Comparison": _comparison,
    "Convergence": _convergence,
    "Sweep": _sweep,
    "SweepResult": _sweep_result,
    "Study": _study,
    "StudyResult": _study_result,
    "Identification": _identification,
    "Found": _found,
    "Standard": _standard,
    "Assessment": _assessment,
    "Reliability": _reliability,
    "ReliabilityResult": _reliability_result,
    "Verification": _verification,
}
"""What is shown of a thing, by the name of its class; the module of its tables is imported when one is shown."""

Drawings = Mapping[str, Callable[[], "Figure | None"]]


def _figures_of_run(result: Result, width: Width) -> Drawings:
    from trainmj.single import figures

    return figures.drawings(result, width)


def _figures_of_identification(found: Found, width: Width) -> Drawings:
    from trainmj.identification.figures import FIGURES

    return {name: partial(draw, found) for name, draw in FIGURES.items()}


def _figures_of_reliability(result: ReliabilityResult, width: Width) -> Drawings:
    from trainmj.reliability.figures import FIGURES

    return {name: partial(draw, result) for name, draw in FIGURES.items()}


_FIGURES: dict[str, Callable[..., Drawings]] = {
    "Result": _figures_of_run,
    "Found": _figures_of_identification,
    "ReliabilityResult": _figures_of_reliability,
}
"""The figures of a thing by the names of their files, likewise."""
