"""Run an identification: search, say what was found and how well it is known, check it against what was held out."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from trainmj.cases.engine import Local
from trainmj.cases.origin import Origin
from trainmj.cases.rows import Row
from trainmj.cases.store import KEY, Store
from trainmj.collision.cases import gathered
from trainmj.collision.channels import Trace
from trainmj.collision.status import UNUSABLE
from trainmj.errors import InputError
from trainmj.files.arguments import given
from trainmj.files.folder import filling, remove_own, staged
from trainmj.identification.figures import FIGURES
from trainmj.identification.found import BASE, FOUND, Found
from trainmj.identification.misfit import Misfit, Trials
from trainmj.identification.plan import Identification, Sample, load_targets
from trainmj.identification.search import Place, Watch, search
from trainmj.identification.uncertainty import uncertainty
from trainmj.identification.unknowns import Point, rounded
from trainmj.output.style import ENDINGS, Format, Width, formats_given, save, styled
from trainmj.scenario import to_yaml

FILE = "trials.sqlite"
SUMMARY = "summary.json"

OWN = (
    r"trials\.sqlite(-\w+)?|(scenario|found)\.yaml|(fit|residuals|parameters|correlations|directions|search)\.csv"
    rf"|(residuals|channels|correlations|search)\.{ENDINGS}|summary\.json|report\.html"
)
"""The files of the folder, as a pattern of their names."""

_TABLES = ("fit", "residuals", "parameters", "correlations", "directions", "search")
_DIGITS = 6  # of the values found
_LATE = 1e-6  # time behind the end that counts as none [s]


def identify(
    targets: Identification | str | Path,
    folder: str | Path,
    *,
    threads: int = 0,
    fresh: bool = False,
    watch: Watch = lambda progress: None,
    progress: Callable[[int], None] = lambda trials: None,
    figures: Sequence[Format] = ("png",),
    figure_width: Width = "page",
) -> Found:
    """Find the values of an identification and write what there is to know of them into a folder.

    Every trial is kept in the folder as it ends; whatever stops the search, the same one goes on and ends at the same
    values. The result depends on the targets file alone, not on threads or interruptions.

    Args:
        targets: an identification, a targets file, or the name of a shipped one.
        folder: made if it is not there.
        threads: native threads; 0 for all cores.
        fresh: start over: remove what an identification left in the folder, but the scenario that it began with.
        watch: told of each generation and iteration.
        progress: told how many trials were just finished.
        figures: formats in which figures are drawn; none for no figures.
        figure_width: of the figures, that of a column or of the page of a journal.

    Raises:
        InputError: if the file breaks a rule, a response does not exist, or the start values cannot be simulated; if
            the folder has trials of another scenario, or of other versions; the message says what differs.
        OutputError: if the folder or a file cannot be written, or another process writes there.
    """
    began = time.monotonic()
    plan, formats = given(targets, Identification, load_targets), formats_given(figures)
    with filling(folder, OWN, plan.files) as folder:
        _check_start(plan, threads)
        if fresh:
            remove_own(folder, OWN, kept=[BASE])
        with Store(folder / FILE, KEY) as store:
            store.agree(Origin("identification", plan.scenario))
            there = len(store)
            trials = Trials(plan.scenario, plan.fitted.cases, plan.columns, store, threads, plan.channels, progress)
            place, way = search(plan, trials, watch)
            point = _final(plan, place)
            misfit = Misfit(plan, trials, plan.spec.method.refine.step_ms)
            known = uncertainty(misfit, point, 2 * plan.spec.method.refine.difference)
            changes = plan.unknowns.changes(point.value)
            samples = {"fitted": (plan.fitted, plan.found(plan.fitted, trials([changes]), [point])[0])}
            if len(plan.held_out):
                apart = Trials(plan.scenario, plan.held_out.cases, plan.columns, store, threads, plan.channels)
                samples["held out"] = (plan.held_out, plan.found(plan.held_out, apart([changes]), [point])[0])
            simulated = trials.simulated
            store.finish()
        seconds = time.monotonic() - began
        result = Found(plan, point, known, samples, tuple(way), folder, simulated, there, seconds)
        _write(result, formats, figure_width)
        return result


def _write(found: Found, formats: Sequence[Format], width: Width) -> None:
    """Write scenario, found values, tables and figures into the folder of an identification.

    Raises:
        OutputError: if a file cannot be written.
    """
    texts = {BASE: to_yaml(found.plan.scenario), FOUND: found.as_yaml()}
    texts |= {f"{name}.csv": getattr(found, name).to_csv(index=False, float_format="%.9g") for name in _TABLES}
    texts[SUMMARY] = json.dumps(found.summary, indent=2) + "\n"
    with staged(found.folder, OWN, SUMMARY, kept=[FILE]) as stage:
        for file, text in texts.items():
            (stage / file).write_bytes(text.encode())
        with styled(width):
            for name, draw in (FIGURES if formats else {}).items():
                if (picture := draw(found)) is not None:
                    save(picture, stage / name, formats)


def _check_start(plan: Identification, threads: int) -> None:
    """Refuse start values without usable numbers in every case, and targets that come to no number there."""
    changes = plan.unknowns.changes(plan.unknowns.start().value)
    cases = [*plan.fitted.cases, *plan.held_out.cases]
    made = ({**changes, **case} for case in cases)
    engine = Local(plan.scenario, threads, plan.channels)
    found = {key: some.row(n) for some in engine(gathered(enumerate(made))) for n, key in enumerate(some.keys)}
    rows = [found[n] for n in range(len(cases))]
    for case, row in zip(cases, rows, strict=True):
        if row["status"] in UNUSABLE:
            raise InputError(f"start values, the case {dict(case)}: {row['status']}: {row['reason']}")
    for k, target in zip(plan.fitted.case, plan.fitted.target, strict=True):
        wanted = plan.targets[target]
        for column in wanted.terms if not wanted.is_channel else ():
            if wanted.part.weight > 0 and not math.isfinite(rows[k][column]):
                where = f"at the start values, in the case {dict(cases[k])} ({rows[k]['status']})"
                rule = f"{column} comes to no number {where}"
                raise plan.source.error(rule, "targets", wanted.name, "response")
    n = len(plan.fitted.cases)
    _check_ends(plan, "data", plan.fitted, rows[:n])
    _check_ends(plan, "held_out", plan.held_out, rows[n:])


def _check_ends(plan: Identification, key: str, sample: Sample, rows: Sequence[Row]) -> None:
    """Refuse channels that go on behind the end of the collision with the start values; a row for each case."""
    shifts = plan.shifts(plan.unknowns.start().value)
    for (data, _), places in sample.channels.items():
        row, last = rows[sample.case[places[0]]], float(sample.time[places[-1]] + shifts[data])
        terms = plan.targets[sample.target[places[0]]].terms
        known = all(np.isfinite(Trace.unpacked(row[name]).at(np.array(last))) for name in terms)
        rule = f"its times end at {last:.6g} s, and the collision at {row['duration_s']:.6g} s with the start values"
        if last > row["duration_s"] + _LATE:
            raise plan.source.error(f"{rule}: use those up to there (between_s)", key, data, "channels")
        if not known:
            rule += ", cut off, which a filter sees 10 ms before"
            raise plan.source.error(f"{rule}: raise simulation.time_limit_s", key, data, "channels")


def _final(plan: Identification, place: Place) -> Point:
    """The values of a place to the digits that are written."""
    values = plan.unknowns.point(place.unit).value
    point = plan.unknowns.solved(np.array([rounded(v, _DIGITS) for v in values]))
    return point._replace(value=np.array([rounded(v, _DIGITS + 2) for v in point.value]))
