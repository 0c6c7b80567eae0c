"""What a study found, each told once for terminal and page: facts, tables and remarks made from its summary."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from trainmj.output.table import Column, Table, judged, passed, warned
from trainmj.units import head

Summary = Mapping[str, Any]
"""What summary.json says: what was asked, and the facts of each step by its name."""

SEARCHES = {"surrogates": "front_on_the_surrogates", "simulator": "front_on_the_simulator"}
"""Where a front may be searched, and the step that does."""

_DIGITS = ".5g"
_FRACTION = 4  # decimals of weights, and of what is 1 at best


def number(value: Any) -> str:
    """A value with five significant digits; a dash if there is none."""
    return str(Column("", digits=_DIGITS).show(value))


def units(summary: Summary) -> dict[str, str]:
    """Units of factors and responses by name."""
    return {name: about["unit"] for name, about in (summary["factors"] | summary["responses"]).items()}


def columns(summary: Summary, names: Iterable[str]) -> dict[str, Column]:
    """Columns of factors and responses, by their heads in the study's files."""
    unit = units(summary)
    return {head(name, unit[name]): Column(name, unit[name], _DIGITS) for name in names}


def design(summary: Summary) -> dict[str, Any]:
    """How the design was made, how well it fills the space, and how its simulations went."""
    made, done = summary["design"], summary["simulations"]
    n, failed = done["n"], done["failed"]
    return {
        "Design": made["method"],
        "Points": f"{made['n']}" + ("" if made["seed"] is None else f", seed {made['seed']}"),
        "Smallest distance": f"{number(made['smallest_distance'])}, factors scaled to 0..1",
        "phi_p": number(made["phi_p"]),
        "Centred discrepancy": number(made["centred_discrepancy"]),
        "Distinct values": ", ".join(f"{k} of {f}" for f, k in zip(summary["factors"], made["levels"], strict=True)),
        "Simulated": judged(
            failed == 0, f"all {n}", f"{failed} of {n} failed and were left out; the first is {done['first_failure']}"
        ),
        "Past a stroke limit": warned(f"{done['exhausted']} of {n}") if done["exhausted"] else passed("none"),
    }


def surrogates(summary: Summary) -> Table:
    """How good the surrogates are."""

    def percent(value: float | None) -> float | None:
        return None if value is None else 100 * value

    return Table(
        [
            Column("Response", text=True),
            Column("unit", text=True),
            Column("range simulated", digits=_DIGITS),
            Column("R² of the fit", digits=_FRACTION, head="R²\nof the fit"),
            Column("mean error, left out", "% of range", 2, head="left out:\nmean error"),
            Column("RMSE, left out", "% of range", 2, head="left out:\nRMSE"),
            Column("R², left out", "", _FRACTION, head="left out:\nR²"),
            Column("surrogate", text=True),
        ],
        [
            (
                name,
                row["unit"],
                row["range"],
                row["r2_fit"],
                percent(row["are_loo"]),
                percent(row["rmse_loo"]),
                row["r2_loo"],
                row["surrogate"],
            )
            for name, row in summary["surrogates"]["responses"].items()
        ],
        "How good the surrogates are",
        "Left out: each point predicted by a surrogate that was fitted to the others.",
    )


def searches(summary: Summary) -> dict[str, dict[str, Any]]:
    """The facts of the fronts that were searched, by where."""
    return {where: summary[step] for where, step in SEARCHES.items() if step in summary}


def fronts(summary: Summary) -> Table:
    """How far the fronts extend."""
    found, unit = searches(summary), units(summary)
    ends = [Column(f"{where}, {end}", digits=_DIGITS) for where in found for end in ("from", "to")]
    return Table(
        [Column("Objective", text=True), Column("unit", text=True), *ends],
        [
            (name, unit[name], *(end for front in found.values() for end in front["extent"][name]))
            for name in summary["objectives"]
        ],
        "Extent of the front",
    )


def notes_on_fronts(summary: Summary) -> Iterator[str]:
    """How the searches went, and what the surrogates' front is worth."""
    for where, front in searches(summary).items():
        yield (
            f"Search on the {where}: {front['evaluations']} evaluations, {front['points']} on the front; "
            f"{front['status']}."
        )
    if "fronts_compared" in summary:
        c = summary["fronts_compared"]
        predicted, simulated = (_decimals(c[f"ratio_{key}"]) for key in ("predicted", "simulated"))
        yield (
            f"Hypervolume, surrogates' front over simulator's: {predicted} as predicted, {simulated} as simulated, "
            f"where {c['kept']} of {c['points']} designs keep the limits."
        )


def weights(summary: Summary) -> Table:
    """How much each objective counts."""
    found = summary["weights"]
    return Table(
        [Column("Objective", text=True), Column("goal", text=True), Column("weight", "", _FRACTION)],
        [(name, summary["objectives"][name], weight) for name, weight in found["weights"].items()],
        "Weights",
        f"From: {found['description']}.",
    )


def decision(summary: Summary) -> Table:
    """The chosen design, and what other methods would choose."""
    found, factors = summary["decision"], columns(summary, summary["factors"])
    designs = {f"chosen: {found['method']}": found["chosen"]} | found["others"]
    return Table(
        [Column("Design", text=True), *factors.values()],
        [(said, *(values[head] for head in factors)) for said, values in designs.items()],
        "Decision",
    )


def notes_on_decision(summary: Summary) -> Iterator[str]:
    """How far the weights may change before another design is chosen."""
    found = summary["decision"]
    for name, (low, high) in found.get("stays", {}).items():
        yield f"The choice stays for weights of {name} from {_decimals(low)} to {_decimals(high)}."
    if "share" in found:
        yield f"It stays for {100 * found['share']:.0f} % of weights scattered by {100 * found['spread']:g} %."


def check(summary: Summary) -> Table:
    """The chosen design, predicted and simulated, and its limits."""
    found = summary["check"]
    status = f"{found['status']} {found['reason']}".strip()
    return Table(
        [
            Column("Response", text=True),
            Column("unit", text=True),
            Column("as it stands", digits=_DIGITS, head="as it\nstands"),
            Column("predicted", digits=_DIGITS),
            Column("simulated", digits=_DIGITS),
            Column("error", "%", "+z.2f"),
            Column("limit", text=True),
            Column("verdict", text=True),
        ],
        [
            (
                row["response"],
                row["unit"],
                row["as_it_stands"],
                row["predicted"],
                row["simulated"],
                row["error_percent"],
                row["limit"].replace(f"{row['response']} ", "").replace("<=", "≤").replace(">=", "≥"),
                judged(row["kept"]),
            )
            for row in found["rows"]
        ],
        "The chosen design, simulated",
        "As it stands: the scenario without the study. Error: predicted less simulated. "
        f"Status of the check: {status}.",
    )


def _decimals(value: float | None) -> str:
    return str(Column("", digits=_FRACTION).show(value))
