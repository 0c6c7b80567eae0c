"""What ``trainmj study`` prints: how it gets on, and the closing summary, at most 80 columns wide."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.status import Status
from rich.table import Table
from rich.text import Text

from trainmj.output.console import new_console, new_table
from trainmj.study.folder import Step
from trainmj.study.plan import Study
from trainmj.study.run import STEPS, StudyResult, Watch


class Screen(Watch):
    """Shows the steps on a terminal as they come; silent where there is none."""

    def __init__(self) -> None:
        """On the error stream, so that what is printed stays clean."""
        self._console = Console(stderr=True, highlight=False)
        self._status = Status("", console=self._console)
        self._shown = sys.stderr.isatty()
        self._step = ""

    def changed(self, changes: Sequence[str]) -> None:
        """Say what has changed, terminal or not: it tells why steps are done again."""
        for change in changes:
            self._console.print(f"Changed: {change}", markup=False, soft_wrap=True)

    def begin(self, step: str) -> None:
        """Show the step."""
        self._step = step
        if self._shown:
            self._status.update(step)
            self._status.start()

    def simulated(self, count: int) -> None:
        """Show how many collisions have been computed."""
        self._status.update(f"{self._step}: {count} collisions so far")

    def done(self, step: Step[Any]) -> None:
        """Leave a line behind."""
        if self._shown:
            said = f"{step.seconds:5.1f} s" if step.computed else "  there"
            self._console.print(f"{STEPS.index(step.name):02d} {step.name:<26}{said}")

    def stop(self) -> None:
        """Take the moving line away."""
        self._status.stop()


def print_study(result: StudyResult) -> None:
    """The closing summary of a study."""
    console = new_console()
    study, facts = result.study, result.summary
    console.print(Text(study.title, style="bold"))
    for line in (_design(facts), _simulations(result)):
        console.print(line, markup=False)
    for table, notes in (
        (_surrogates(facts["surrogates"]["responses"]), ["Each point left out in turn; errors in % of the range."]),
        (_fronts(study, facts), _front_notes(facts)),
        (_decision(study, facts), _decision_notes(facts)),
        (_check(study, facts), _verdict(study, facts)),
    ):
        console.print()
        console.print(table)
        for note in notes:
            console.print(note, markup=False)
    console.print(f"Written to {result.folder}; steps done now: {', '.join(result.computed) or 'none'}", markup=False)


def _design(facts: Mapping[str, Any]) -> str:
    d = facts["design"]
    levels = ", ".join(map(str, d["levels"]))
    return (
        f"Design: {d['n']} points, {d['method']}; smallest distance {d['smallest_distance']:.3f}, "
        f"phi_p {_number(d['phi_p'])}, centred discrepancy {d['centred_discrepancy']:.4f}, levels {levels}"
    )


def _simulations(result: StudyResult) -> str:
    s = result.summary["simulations"]
    text = f"Simulations: {result.simulated} now; of the design's {s['n']}, {s['failed']} failed"
    if s["failed"]:
        text += f" and were left out (the first: {s['first_failure']})"
    return text + (f", {s['exhausted']} passed a stroke limit" if s["exhausted"] else "")


def _surrogates(rows: Mapping[str, Mapping[str, Any]]) -> Table:
    table = new_table(
        "Response",
        "range\nsimulated",
        "fit\nR2",
        "left out\nARE %",
        "left out\nRMSE %",
        "left out\nR2",
        title="Surrogates",
    )
    for name, row in rows.items():
        table.add_row(
            f"{name} {row['unit']}",
            _number(row["range"]),
            _number(row["r2_fit"], ".4f"),
            _number(row["are_loo"], ".2f", 100),
            _number(row["rmse_loo"], ".2f", 100),
            _number(row["r2_loo"], ".4f"),
        )
    return table


def _fronts(study: Study, facts: Mapping[str, Any]) -> Table:
    searches = _searches(facts)
    heads = [f"{said}\n{end}" for said in searches for end in ("from", "to")]
    table = new_table("Objective", *heads, title="Fronts: extent")
    for r in study.objectives:
        ends = [end for front in searches.values() for end in front["extent"][r.name]]
        table.add_row(f"{r.name} {r.unit}", *[_number(end, ".5g") for end in ends])
    return table


def _front_notes(facts: Mapping[str, Any]) -> list[str]:
    notes = [
        f"On the {said}: {front['points']} designs of {front['evaluations']} evaluations; {front['status']}"
        for said, front in _searches(facts).items()
    ]
    if "fronts_compared" in facts:
        c = facts["fronts_compared"]
        notes.append(
            f"Hypervolume, surrogates' front over simulator's: {_number(c['ratio_predicted'], '.4f')} as predicted, "
            f"{_number(c['ratio_simulated'], '.4f')} simulated ({c['kept']} of {c['points']} designs keep the limits)"
        )
    return notes


def _searches(facts: Mapping[str, Any]) -> dict[str, Any]:
    steps = {"surrogates": "front_on_the_surrogates", "simulator": "front_on_the_simulator"}
    return {said: facts[step] for said, step in steps.items() if step in facts}


def _decision(study: Study, facts: Mapping[str, Any]) -> Table:
    d = facts["decision"]
    table = new_table("Design", *[f"{f.name}\n{f.unit}" for f in study.space.factors], title="Decision")
    for said, values in ((f"chosen: {d['method']}", d["chosen"]), *d["others"].items()):
        table.add_row(said, *[_cell(values[h]) for h in study.heads])
    return table


def _decision_notes(facts: Mapping[str, Any]) -> list[str]:
    d, w = facts["decision"], facts["weights"]
    weights = ", ".join(f"{name} {weight:.4f}" for name, weight in w["weights"].items())
    notes = [f"Weights: {weights} ({w['description']})"]
    if "stays" in d:
        name, (low, high) = next(iter(d["stays"].items()))
        notes.append(
            f"The choice stays for weights of {name} from {low:.4f} to {high:.4f}, and for {100 * d['share']:.0f} % "
            f"of weights scattered by {100 * d['spread']:g} %"
        )
    return notes


def _check(study: Study, facts: Mapping[str, Any]) -> Table:
    table = new_table(
        "Response",
        "as it\nstands",
        "predicted",
        "simulated",
        "error\n%",
        "limit",
        "kept",
        title="Chosen design, checked",
    )
    for row in facts["check"]["rows"]:
        limits = [limit for limit in study.limits if limit.response.name == row["response"]]
        limit = "; ".join(limit.text.removeprefix(row["response"]).strip() for limit in limits)
        kept = "" if row["kept"] is None else "yes" if row["kept"] else "NO"
        numbers = [_number(row[key], ".5g") for key in ("as_it_stands", "predicted", "simulated")]
        table.add_row(f"{row['response']} {row['unit']}", *numbers, _number(row["error_percent"], "+z.2f"), limit, kept)
    return table


def _verdict(study: Study, facts: Mapping[str, Any]) -> list[str]:
    check = facts["check"]
    lines = [f"Status of the check: {check['status']}" + (f" ({check['reason']})" if check["reason"] else "")]
    if not check["kept"] and study.limits:
        lines.append(
            "The chosen design does not keep its limits when simulated: give the constraint a margin, add points to "
            "the design, or decide on the simulator's front."
        )
    return lines


def _cell(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _number(value: float | None, form: str = ".4g", scale: float = 1.0) -> str:
    return "-" if value is None else format(scale * value, form)
