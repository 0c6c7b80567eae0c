"""What there is to know before a study is believed: the only place where it judges itself.

A remark that a study fails by makes it not to be trusted, and its command end with 1; the others warn. A new one is a
generator below: it reads the study, the facts of its steps and their tables, and says what, of what, and the cure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from trainmj.collision.status import COARSE, PAST_LIMITS, UNUSABLE
from trainmj.doe import parse_terms
from trainmj.files.source import Path
from trainmj.scenario import Scenario
from trainmj.study.designs import Designs
from trainmj.study.file import AtQuantile
from trainmj.study.folder import Tables
from trainmj.study.plan import Limit, Study
from trainmj.study.rules import ROBUST
from trainmj.units import ROUND_OFF

Facts = Mapping[str, Any]
"""The facts of each step by its name, as in summary.json."""

_LEAST_FREEDOM = 3  # points more than terms, below which R2 says little
_REACH = 3.0  # errors of the surrogate (RMSE of points left out) within which a limit is in reach


@dataclass(frozen=True)
class Remark:
    """One thing to know.

    Attributes:
        kind: whether the study fails by it, or it warns.
        about: a factor, a response or a part of the study.
        text: what was found, and the cure.
    """

    kind: Literal["fail", "warn"]
    about: str
    text: str


def of_plan(study: Study) -> tuple[Remark, ...]:
    """What can be known before anything is computed."""
    return (*_loads(study, {}), *_few_draws(study))


def of_result(study: Study, facts: Facts, tables: Tables) -> tuple[Remark, ...]:
    """What a finished study has to say of itself, the worst first.

    Args:
        study: what was asked.
        facts: of each step.
        tables: of all steps, by file name without ending.
    """
    simulated = Designs.read(study, tables["02_simulations"])
    chosen = Designs.read(study, tables["09_decision"].iloc[[0]])
    found: Iterable[Iterable[Remark]] = (
        _check(study, facts),
        _surrogates(study, facts),
        _omitted(study, tables),
        _freedom(tables),
        _nothing_to_gain(study, facts),
        _confounded(study, simulated),
        _loads(study, facts["decision"]["chosen"]),
        _edges(study, chosen),
        _left_out(study, simulated, chosen),
        _few_draws(study),
        _held(facts),
        _coarse(simulated, facts),
    )
    return tuple(sorted((remark for part in found for remark in part), key=lambda remark: remark.kind != "fail"))


def _in_reach(limit: Limit, row: Facts) -> bool:
    """Whether a limit could be passed, as far as the design and the error of the surrogate tell."""
    nearest = row["high"] if limit.sign > 0 else row["low"]
    return bool(limit.sign * (limit.value - nearest) < _REACH * row["error"])


def _decides(study: Study, name: str, row: Facts) -> bool:
    """Whether the search rests on a response: an objective, or a limit in reach."""
    return _is_objective(study, name) or any(_in_reach(o, row) for o in study.limits if o.response.name == name)


def _is_objective(study: Study, name: str) -> bool:
    """Whether a response is an objective, or one of the load cases of which the worst is one."""
    return any(r.stated in study.spec.objectives for r in study.responses if r.name == name)


def _surrogates(study: Study, facts: Facts) -> Iterator[Remark]:
    least = study.spec.quality.least_r2
    for name, row in facts["surrogates"]["responses"].items():
        if not row["poor"]:
            continue
        said = f"R² of points left out is {row['r2']:.3f}, below {least:g}"
        cure = "add points, change its terms or take kriging"
        if not _decides(study, name, row):
            limited = " (its limit is out of reach)" if any(o.response.name == name for o in study.limits) else ""
            yield Remark("warn", name, f"{said}: do not rely on its predictions{limited}; {cure}.")
        elif study.on_surrogates:
            text = f"{said}: the search rests on this surrogate; {cure}, or decide on the simulator's front."
            yield Remark("fail", name, text)
        else:
            text = f"{said}: nothing rests on this surrogate, for the decision is on the simulator's front."
            yield Remark("warn", name, text)


def _check(study: Study, facts: Facts) -> Iterator[Remark]:
    check, quality = facts["check"], study.spec.quality
    if check["status"] in UNUSABLE:
        text = f"has no numbers that may be used when simulated: {check['status']} {check['reason']}".rstrip()
        yield Remark("fail", "chosen design", f"{text}.")
        return
    if check["status"] in PAST_LIMITS and check["kept"]:
        text = f"{check['status']} {check['reason']} when simulated, which no constraint of the study forbids."
        yield Remark("warn", "chosen design", text)
    for row in check["rows"]:
        name, error = row["response"], abs(row["predicted"] - row["simulated"])
        if not np.isfinite(row["simulated"]):
            yield Remark("fail", name, "came to no number when simulated.")
            continue
        if row["kept"] is False:
            cure = "what check changes (set) moves it; set the same in the whole study"
            if study.on_surrogates:
                cure = "give the constraint a margin, add points to the design, or decide on the simulator's front"
            text = f"{row['limit']} is not kept when simulated ({row['simulated']:.6g}): {cure}."
            yield Remark("fail", name, text)
        of = facts["surrogates"]["responses"].get(name)
        if of is None:
            continue  # the worst of load cases, each of which is judged
        if row["missed"] and _decides(study, name, of):
            text = (
                f"the prediction, {row['predicted']:.5g}, misses the simulation, {row['simulated']:.5g}, by "
                f"{abs(row['error_of_range_percent']):.1f} % of the range over the design, more than "
                f"{quality.largest_error_percent:g} %: "
            )
            if study.on_surrogates:
                yield Remark("fail", name, f"{text}add points there, or decide on the simulator's front.")
            else:
                yield Remark("warn", name, f"{text}what check changes (set) moves it; set the same in the whole study.")
        for limit in (o for o in study.limits if o.response.name == name and row["kept"]):
            left, unit = -float(limit.excess(np.array(row["simulated"]))), row["unit"]
            if error > max(left, ROUND_OFF * abs(limit.value)):
                text = (
                    f"comes to {left:.3g} {unit} of {limit.text} when simulated, less than the prediction was off by "
                    f"({error:.3g} {unit}): a design nearby may pass it. Give the constraint a larger margin."
                )
                yield Remark("warn", name, text)


def _omitted(study: Study, tables: Tables) -> Iterator[Remark]:
    if "04_coefficients" not in tables:
        return
    strong, beyond = study.spec.quality.strong_correlation, 1.0 - study.spec.correlation.level
    found = tables["03_correlation"]
    found = found[(found["r"].abs() >= strong) & (found["p"] < beyond)]
    for response, part in tables["04_coefficients"].groupby("response", sort=False):
        powers = np.array(parse_terms(part["term"], study.space.names))
        without = {n for n, power in zip(study.space.names, powers.max(axis=0), strict=True) if power == 0}
        own = found[(found["response"] == response) & found["factor"].isin(without)].sort_values("p")
        for row in own.drop_duplicates("factor").to_dict("records"):
            text = (
                f"its surrogate has no term in {row['factor']}, with which it correlates strongly "
                f"(r = {row['r']:+.2f}, p = {row['p']:.2g}): add terms in {row['factor']}."
            )
            yield Remark("warn", str(response), text)


def _freedom(tables: Tables) -> Iterator[Remark]:
    if "04_anova" not in tables:
        return
    anova = tables["04_anova"]
    for row in anova[anova["source"] == "residuals"].to_dict("records"):
        if row["dof"] < _LEAST_FREEDOM:
            points = tables["02_simulations"].shape[0]
            text = (
                f"its surrogate leaves {row['dof']:.0f} degree{'s' * (row['dof'] != 1)} of freedom, less than "
                f"{_LEAST_FREEDOM}: R² then flatters it. Take fewer terms or more than {points} points."
            )
            yield Remark("warn", row["response"], text)


def _nothing_to_gain(study: Study, facts: Facts) -> Iterator[Remark]:
    for name, row in facts["surrogates"]["responses"].items():
        if _is_objective(study, name) and row["negligible"]:
            said = f"hardly varies over the design ({row['low']:.6g} to {row['high']:.6g} {row['unit']})"
            text = f"{said}: there is nothing to gain, and what tells designs apart in it may be noise."
            yield Remark("warn", name, text)


def _confounded(study: Study, simulated: Designs) -> Iterator[Remark]:
    x, _ = simulated.usable()
    names, most = study.space.names, study.spec.quality.confounding_correlation
    vary = np.flatnonzero(np.ptp(x, axis=0) > 0)
    if vary.size < 2:
        return
    r = np.asarray(np.corrcoef(x[:, vary], rowvar=False))
    for i, j in zip(*np.nonzero(np.triu(np.abs(r) > most, 1)), strict=True):
        a, b = names[vary[i]], names[vary[j]]
        text = (
            f"are correlated in the design, r = {r[i, j]:+.2f}: in correlations and main effects each mirrors the "
            "other. Take more points, or another seed."
        )
        yield Remark("warn", f"{a} and {b}", text)


def _loads(study: Study, chosen: Mapping[str, Any]) -> Iterator[Remark]:
    """Factors that the train does not decide, with the value that was chosen, if one was."""
    for factor, targets in zip(study.space.factors, study.targets, strict=True):
        places = [place for target in targets for place in study.scenario.places(target)]
        kinds = [_not_of_the_train(study.scenario, place) for place in places]
        if not all(kinds):
            continue
        told = f" (it chose {_shown(chosen[factor.head])} {factor.unit}".rstrip() + ")" if chosen else ""
        text = (
            f"is {kinds[0]} and no design of the train ({', '.join(targets)}), but the search is free to choose "
            f"it{told}: fix it under set, or vary it with trainmj sweep."
        )
        yield Remark("warn", factor.name, text)


def _not_of_the_train(scenario: Scenario, place: Path) -> str:
    """What a value of a scenario is, if it is none that the train under test decides; empty if it is."""
    own = scenario.collision.train

    def devices(name: str) -> set[str]:
        train, obstacle = scenario.trains.get(name), scenario.obstacles.get(name)
        return {d for joint in train.joints() for d in joint} if train else {obstacle.front} if obstacle else set()

    match place:
        case ("collision", "train", *_):
            return ""
        case ("collision", *_):
            return "a load"
        case ("simulation", *_):
            return "a setting of the computation"
        case ("trains" | "obstacles", name, *_) if name != own:
            return "a value of the partner"
        case ("trains", _, *inner) if {"load", "rail_friction", "adhesion"} & set(inner):
            return "a load"
        case ("devices", name, *_) if name in devices(scenario.collision.partner) - devices(own):
            return "a value of the partner"
    return ""


def _edges(study: Study, chosen: Designs) -> Iterator[Remark]:
    for factor, value in zip(study.space.factors, chosen.points[0].tolist(), strict=True):
        for bound, which in ((factor.lower, "lower"), (factor.upper, "upper")):
            if factor.kind != "choice" and abs(value - bound) <= 1e-9 * (factor.upper - factor.lower):
                text = (
                    f"was chosen at its {which} bound, {f'{value:g} {factor.unit}'.rstrip()}: what lies beyond may be "
                    "better. Widen the bounds unless something outside the study sets them."
                )
                yield Remark("warn", factor.name, text)


def _left_out(study: Study, simulated: Designs, chosen: Designs) -> Iterator[Remark]:
    away = np.linalg.norm(study.space.to_unit(simulated.points) - study.space.to_unit(chosen.points), axis=1)
    nearest = int(np.argmin(away))
    if simulated.failed[nearest]:
        text = (
            f"the nearest point of the design, test {nearest + 1}, was left out ({simulated.status[nearest]}): the "
            f"surrogates extrapolate there. It is {away[nearest]:.3g} away, the nearest that was used "
            f"{away[~simulated.failed].min():.3g}, with factors scaled to 0..1."
        )
        yield Remark("warn", "chosen design", text)


def _few_draws(study: Study) -> Iterator[Remark]:
    """Quantiles that lie beyond the trains of which they are asked."""
    part = study.spec.robust
    if part is None:
        return
    asked = {limit.response.stated: part.probability for limit in study.limits} | part.probabilities
    asked |= {
        name: min(of.quantile, 1.0 - of.quantile) for name, of in part.objectives.items() if isinstance(of, AtQuantile)
    }
    for name, share in asked.items():
        if share * part.draws < 1.0:
            text = (
                f"{100 * share:.6g} % of {part.draws} trains is less than one: the search takes the worst of them, "
                f"which does not tell so small a share. Ask for {math.ceil(10 / share - 1e-6)} draws or a larger share."
            )
            yield Remark("warn", name, text)


def _coarse(simulated: Designs, facts: Facts) -> Iterator[Remark]:
    """Simulations whose step is coarse for their peaks."""
    count = sum(COARSE in str(reason) for reason in simulated.reason)
    chosen = COARSE in str(facts["check"]["reason"])
    if not (count or chosen):
        return
    tests = f"{count} of {len(simulated)} tests{' and the chosen design' if chosen else ''} have"
    text = (
        f"{tests if count else 'The chosen design has'} a {COARSE}, for the peaks in the reason: where responses are "
        "peaks, set a smaller simulation.step_ms."
    )
    yield Remark("warn", "step", text)


def _held(facts: Facts) -> Iterator[Remark]:
    """Limits that the robust design seems to keep, but not surely."""
    if "margins" in facts and not facts["margins"]["kept"]:
        text = (
            f"did not keep its limits surely after {facts['margins']['attempts']} attempts to find margins: give the "
            "constraints larger ones, or ask for more draws."
        )
        yield Remark("warn", "robust design", text)
    held = facts.get("held", {"limits": []})
    for row in held["limits"]:
        if row["design"] == ROBUST and row["kept"] and row["upper"] > row["wanted"]:
            text = (
                f"is passed by {100 * row['probability']:.3g} % of {held['trains']} trains, no more than "
                f"{100 * row['wanted']:g} %, but its interval reaches {100 * row['upper']:.3g} %: give the constraint "
                "a margin, or ask for more check_draws."
            )
            yield Remark("warn", row["limit"], text)


def _shown(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
