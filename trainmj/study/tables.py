"""What a study found, for terminal and page: facts, tables and remarks made from its summary."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from trainmj.collision.status import Kind
from trainmj.output.table import Column, Table, Verdict, failed, judged, passed, warned, worded
from trainmj.study.designs import governs
from trainmj.study.file import ChoiceFactor
from trainmj.study.plan import LIMITS, Study
from trainmj.study.remarks import Remark
from trainmj.study.robust import ANY
from trainmj.study.rules import NOMINAL, ROBUST
from trainmj.units import against, head

Summary = Mapping[str, Any]
"""What summary.json says: what was asked, and the facts of each step by its name."""

_DIGITS = ".5g"
_FRACTION = 4  # decimals of weights, and of what is 1 at best
_NAME, _UNIT = Column("Response", text=True), Column("unit", text=True)


def number(value: Any, digits: int | str = _DIGITS) -> str:
    """A value with five significant digits, or in another format; a dash if there is none."""
    return str(Column("", digits=digits).show(value))


def columns(summary: Summary, *groups: str) -> dict[str, Column]:
    """Columns of the factors, responses or objectives, by their heads in the study's files."""
    about = summary["factors"] | summary["responses"]
    units = {name: about[name]["unit"] for group in groups for name in summary[group]}
    return {head(name, unit): Column(name, unit, _DIGITS) for name, unit in units.items()}


def table_of(rows: Iterable[Mapping[Any, Any]], columns: Mapping[str, Column], title: str, note: str = "") -> Table:
    """A table of rows: the values under the keys that have a column."""
    return Table([*columns.values()], [[row[key] for key in columns] for row in rows], title, note)


def factors_of(study: Study) -> Table:
    """What a study varies."""
    rows = []
    for name, part in study.spec.factors.items():
        if isinstance(part, ChoiceFactor):
            values = ", ".join(map(str, part.levels))
        else:
            values = f"{part.bounds[0]:g} to {part.bounds[1]:g} {part.stated_unit}".rstrip()
        rows.append([name, values, ", ".join(part.targets)])
    return Table(worded("Factor", "values", "sets"), rows)


def responses_of(study: Study) -> Table:
    """What a study asks of its responses."""
    asked: dict[str, list[str]] = {r.name: [study.spec.objectives[r.stated]] for r in study.objectives}
    for limit in study.limits:
        asked.setdefault(limit.response.name, []).append(limit.text.removeprefix(f"{limit.response.name} "))
    rows = [[r.name, r.column, ", ".join(asked.get(r.name, ["-"]))] for r in study.responses]
    rows += [[r.name, f"{r.column}, worst of all load cases", ", ".join(asked[r.name])] for r in study.worst_of_cases]
    return Table([_NAME, *worded("column", "wanted")], rows)


def cases_of(study: Study) -> Table:
    """The load cases of a study."""
    rows = [[name, scenario.subject] for name, scenario in study.scenarios.items()]
    return Table(worded("Load case", "collision"), rows)


def remarks_of(found: Iterable[Remark]) -> Table:
    """What there is to know before a study is believed."""
    rows = [[failed() if r.kind == "fail" else warned("warning"), r.about, r.text] for r in found]
    return Table(worded("Remark", "about", "what was found"), rows, "Remarks")


def remarks(summary: Summary) -> Table:
    """The remarks of a finished study."""
    return remarks_of(Remark(**remark) for remark in summary["remarks"])


def trust(summary: Summary) -> Verdict:
    """Whether the study is to be trusted."""
    reasons = sum(remark["kind"] == "fail" for remark in summary["remarks"])
    warnings = len(summary["remarks"]) - reasons
    counted = f"{warnings} warning{'s' * (warnings != 1)}"
    if reasons:
        return failed(f"not to be trusted, for {reasons} reason{'s' * (reasons != 1)}")
    return warned(f"verified by simulation, with {counted}") if warnings else passed("verified by simulation")


def verdict(summary: Summary) -> Verdict:
    """Whether the study is to be trusted, the chosen design, and how it keeps its limits when simulated."""
    whole, found = trust(summary), summary["check"]
    design = _design(summary, summary["decision"]["chosen"])
    limited = [row for row in found["rows"] if row["kept"] is not None]
    past = [row for row in limited if not row["kept"]]
    said = [f"Chosen: {design}, {whole.text}"]
    if past:
        which = "; ".join(f"{_limit(row)}, found {number(row['simulated'])}" for row in past)
        said.append(f"{len(past)} of {len(limited)} limits of the study are not kept: {which}")
    elif limited:
        near = min(limited, key=_spare)
        shown = max((against(near["simulated"], value, -5) for value in near["limits"]), key=len)
        which = f"all {len(limited)} limits of the study are kept, nearest" if limited[1:] else "its limit is kept:"
        said.append(f"{which} {_limit(near)}, found {shown}")
    if found["status"] != Kind.OVER:
        said.append(f"when simulated: {found['status']} {found['reason']}".rstrip())
    kinds = [whole.kind]
    if "robust" in summary:
        robust = trust(summary["robust"])
        said.append(f"the robust design is {robust.text}")
        kinds.append(robust.kind)
    return Verdict(next(kind for kind in ("fail", "warn", "pass") if kind in kinds), f"{'; '.join(said)}.")


def _limit(row: Mapping[str, Any]) -> str:
    return str(row["limit"]).replace("<=", "≤").replace(">=", "≥")


def _spare(row: Mapping[str, Any]) -> float:
    """What is left to the nearest of its limits, relative to that."""
    return float(min(abs(row["simulated"] - limit) / (abs(limit) or 1.0) for limit in row["limits"]))


def design(summary: Summary) -> dict[str, Any]:
    """How the design was made, how well it fills the space, and how its simulations went."""
    made, done = summary["design"], summary["simulations"]
    n, lost, invalid = done["n"], done["failed"], done["not_valid"]
    left_out = f"{lost} of {n} are left out, {lost - invalid} failed and {invalid} not valid; the first is "
    return {
        "Design": made["method"],
        "Points": f"{made['n']}" + ("" if made["seed"] is None else f", seed {made['seed']}"),
        "Smallest distance": f"{number(made['smallest_distance'])}, factors scaled to 0..1",
        "phi_p": number(made["phi_p"]),
        "Centred discrepancy": number(made["centred_discrepancy"]),
        "Distinct values": ", ".join(f"{k} of {f}" for f, k in zip(summary["factors"], made["levels"], strict=True)),
        "Simulated": judged(lost == 0, f"all {n}", f"{left_out}{done['first_failure']}"),
        "Past a limit": warned(f"{done['past_limits']} of {n}") if done["past_limits"] else passed("none"),
    }


def surrogates(summary: Summary) -> Table:
    """How good the surrogates are."""
    shown = {
        "response": _NAME,
        "unit": _UNIT,
        "range": Column("range simulated", digits=_DIGITS),
        "r2_fit": Column("R² of the fit", digits=_FRACTION, head="R²\nof the fit"),
        "are_loo": Column("mean error, left out", "% of range", 2, head="left out:\nmean error"),
        "rmse_loo": Column("RMSE, left out", "% of range", 2, head="left out:\nRMSE"),
        "r2_loo": Column("R², left out", "", _FRACTION, head="left out:\nR²"),
        "judged": Column("verdict", text=True),
        "surrogate": Column("surrogate", text=True),
    }
    rows = [
        row
        | {key: None if row[key] is None else 100 * row[key] for key in ("are_loo", "rmse_loo")}
        | {
            "judged": warned("poor")
            if row["poor"]
            else Verdict("none", "constant")
            if row["r2"] is None
            else passed("good")
        }
        for row in summary["surrogates"]["responses"].values()
    ]
    note = "Left out: each point predicted by a surrogate that was fitted to the others."
    return table_of(rows, shown, "How good the surrogates are", note)


def searches(summary: Summary) -> dict[str, dict[str, Any]]:
    """The facts of each search, by what was searched."""
    steps = {where: f"front_on_the_{where}" for where in ("surrogates", "simulator")}
    return {where: summary[step] for where, step in steps.items() if step in summary}


def fronts(summary: Summary) -> Table:
    """How far the fronts extend."""
    found = searches(summary)
    ends = [Column(f"{where}, {end}", digits=_DIGITS) for where in found for end in ("from", "to")]
    return Table(
        [Column("Objective", text=True), _UNIT, *ends],
        [
            (c.name, c.unit, *(end for front in found.values() for end in front["extent"][c.name]))
            for c in columns(summary, "objectives").values()
        ],
        "Extent of the front",
    )


def notes_on_fronts(summary: Summary) -> Iterator[str]:
    """How the searches went, and what the surrogates' front is worth."""
    if "margins" in summary:
        made = summary["margins"]
        said = ", ".join(f"{number(margin, 3)} inside {limit}" for limit, margin in made["margins"].items() if margin)
        yield f"Margins found by simulation in {made['attempts']} attempts: {said or 'none'}."
    for where, front in searches(summary).items():
        left_out = f" ({front['failed']} failed or not valid)" if front["failed"] else ""
        yield (
            f"Search on the {where}: {front['evaluations']} evaluations{left_out}, {front['points']} on the front; "
            f"{front['status']}."
        )
        for name, counts in front.get("governing", {}).items():
            said = ", ".join(f"{what} for {n}" for what, n in counts.items())
            yield f"{'Nearest limit' if name == LIMITS else f'{name} is governed by'}: {said} of its designs."
    if "fronts_compared" in summary:
        c = summary["fronts_compared"]
        predicted, simulated = (number(c[f"ratio_{key}"], _FRACTION) for key in ("predicted", "simulated"))
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
    found = summary["decision"]
    designs = {f"chosen: {found['method']}": found["chosen"]} | found["others"]
    rows = [{"design": said} | values for said, values in designs.items()]
    return table_of(rows, {"design": Column("Design", text=True)} | columns(summary, "factors"), "Decision")


def notes_on_decision(summary: Summary) -> Iterator[str]:
    """Which load case governs the chosen design; how far the weights may change before another one is chosen."""
    found = summary["decision"]
    governing = {name: found["chosen"].get(governs(name)) for name in (*summary["objectives"], LIMITS)}
    for name, what in governing.items():
        if what:
            yield f"Nearest limit of the chosen design: {what}." if name == LIMITS else f"{name} is governed by {what}."
    for name, ends in found.get("stays", {}).items():
        low, high = (number(end, _FRACTION) for end in ends)
        yield f"The choice stays for weights of {name} from {low} to {high}."
    if "share" in found:
        yield f"It stays for {100 * found['share']:.0f} % of weights scattered by {100 * found['spread']:g} %."


def check(summary: Summary) -> Table:
    """The chosen design, predicted and simulated, and its limits."""
    found = summary["check"]
    cases = {"load_case": Column("load case", text=True, head="load\ncase")} if summary.get("cases") else {}
    shown = {
        "stated" if cases else "response": _NAME,
        **cases,
        "unit": _UNIT,
        "as_it_stands": Column("as it stands", digits=_DIGITS, head="as it\nstands"),
        "predicted": Column("predicted", digits=_DIGITS),
        "simulated": Column("simulated", digits=_DIGITS),
        "error_percent": Column("error", "%", "+z.2f"),
        "error_of_range_percent": Column("error over range", "%", "+z.1f", head="over\nrange"),
        "limit": Column("limit", text=True),
        "kept": Column("verdict", text=True),
    }
    rows = []
    worst = {row["stated"] for row in found["rows"] if row["response"] == row.get("stated")}
    for row in found["rows"]:
        if row["response"] in worst:
            row = row | {"stated": f"{row['stated']}, worst"}
        limit = row["limit"].replace(f"{row['response']} ", "").replace("<=", "≤").replace(">=", "≥")
        rows.append(row | {"limit": limit, "kept": judged(row["kept"])})
        if row.get("limits") and row["simulated"] is not None:
            rows[-1]["simulated"] = max((against(row["simulated"], value, -5) for value in row["limits"]), key=len)
    status, stands = (f"{s['status']} {s['reason']}".strip() for s in (found, summary["as_it_stands"]))
    as_it_stands, simulated = summary["as_it_stands"].get("set", {}), found.get("set", {})
    apart = " trainmj run on the scenario sets none of this, so its numbers differ." if as_it_stands else ""
    note = (
        f"As it stands: the scenario{_with(as_it_stands)}{_step(summary['as_it_stands'])}. "
        f"Simulated: the chosen design{_with(simulated)}{_step(found)}.{apart} "
        "Error: predicted less simulated, over the simulated value and over the range of the design. "
        f"Status as it stands: {stands}; of the check: {status}."
    )
    governing = dict(found.get("governing", {}))
    if nearest := governing.pop(LIMITS, ""):
        note = f"The limit that is nearest, or passed by most, is {nearest}. {note}"
    if governing:
        said = ", ".join(f"{name} by {case}" for name, case in governing.items())
        note = f"Governed: {said}. {note}"
    return table_of(rows, shown, "The chosen design, simulated", note)


def held(summary: Summary) -> Iterator[Table]:
    """How the designs hold under the tolerances, each a column: shares of trains past each limit, and objectives."""
    found = summary["robust"]["held"]
    names = list(found["designs"])
    shares = {name: Column(name, "%", text=True) for name in names}
    rows = []
    by_limit: dict[str, dict[str, Any]] = {}
    for row in found["limits"]:
        by_limit.setdefault(row["limit"], {})[row["design"]] = row
    for limit, of in by_limit.items():
        wanted, robust = of[ROBUST]["wanted"], of[ROBUST]
        asked = "-" if wanted is None else f"≤ {100 * wanted:g}"
        kept: Verdict | str = "-"
        if wanted is not None:
            sure = not robust["kept"] or robust["upper"] <= wanted
            kept = judged(robust["kept"]) if sure else warned("uncertain")
        shown = limit.replace("<=", "≤").replace(">=", "≥")
        rows.append([shown, *(_share(of[name]) for name in names), asked, kept])
    without = sum(row["without_numbers"] for row in found["limits"] if row["limit"] != ANY)
    note = (
        f"{found['trains']} trains as built of each design, with the 95 % interval. "
        + (f"{without} results without numbers that may be used count as passed. " if without else "")
        + "; ".join(f"{name}: {_design(summary, design)}" for name, design in found["designs"].items())
        + "."
    )
    yield Table(
        [Column("Limit", text=True), *shares.values(), Column("wanted", "%", text=True), Column("robust", text=True)],
        rows,
        "Trains as built that pass a limit",
        note,
    )
    of_response: dict[tuple[str, str], dict[str, Any]] = {}
    for row in found["objectives"]:
        of_response.setdefault((row["response"], row["unit"]), {})[row["design"]] = row
    yield Table(
        [_NAME, _UNIT, *(Column(name, text=True) for name in names), Column("robust - nominal", "%", "+z.2f")],
        [
            [
                response,
                unit,
                *(f"{number(of[name]['mean'])} ± {number(of[name]['sd'], '.2g')}" for name in names),
                _change(of[ROBUST]["mean"], of[NOMINAL]["mean"]),
            ]
            for (response, unit), of in of_response.items()
        ],
        "What it costs: mean and standard deviation over the trains",
    )


def _change(robust: float | None, nominal: float | None) -> float | None:
    """What a mean changes by [%]; None where too few trains have numbers, or it is measured by 0."""
    return 100.0 * (robust - nominal) / nominal if robust is not None and nominal else None


def _share(row: Mapping[str, Any]) -> str:
    """A probability in % with its interval."""
    p, low, high = (f"{100 * row[key]:.3g}" for key in ("probability", "lower", "upper"))
    return f"{p} ({low} to {high})"


def _design(summary: Summary, design: Mapping[str, Any]) -> str:
    shown = columns(summary, "factors")
    return ", ".join(f"{c.name} = {number(design[key])} {c.unit}".rstrip() for key, c in shown.items())


def _with(changes: Mapping[str, Any]) -> str:
    """What a simulation of the study changes beside its factors."""
    said = ", ".join(f"{path} = {value}" for path, value in changes.items())
    return f" with {said}" if said else ""


def _step(found: Mapping[str, Any]) -> str:
    """The time step of what was simulated, of several load cases each; nothing if it is said among the changes."""
    steps = " and ".join(f"{step:g}" for step in found.get("step_ms", ()))
    return f" at a step of {steps} ms" if steps and "simulation.step_ms" not in found.get("set", {}) else ""
