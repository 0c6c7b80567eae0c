"""What changes of a scenario do: computed, and told as the page shows it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import cached_property
from threading import Lock
from typing import Any, NamedTuple

from trainmj.cases.effect import OF_MANY, idle, idle_held, refuse
from trainmj.collision.chain import Chain
from trainmj.collision.quantities import TRAIN
from trainmj.collision.result import HISTORIES, Result
from trainmj.collision.simulation import run
from trainmj.collision.status import MEANING
from trainmj.collision.summary import Summary, summarise
from trainmj.errors import TrainmjError
from trainmj.explore.values import parameters_of, values_of
from trainmj.files.text import printable
from trainmj.output.blocks import Section
from trainmj.output.page import fragment
from trainmj.output.table import Verdict, failed
from trainmj.scenario import Scenario, to_yaml
from trainmj.single.page import subjects
from trainmj.single.tables import outcome, why_not_valid
from trainmj.units import in_digits

_SAMPLES = 150  # of a line over time, and of the animation
_KEPT = 3  # collisions, of which a page may ask for more; one of a long train has many megabytes
_KEY = [quantity for quantity in TRAIN if quantity.key in ("TS", "TAMA")]
_ALWAYS = "collision.speed_km_h"  # has a slider, whether the scenario gives it a short name or not
NUMBERS = "numbers"
"""What stands for every number of a collision among the titles of sections."""

Values = Mapping[str, float | str]
"""Changes by path or parameter; text where somebody typed what is no number, for the message that says so."""


class Seen(NamedTuple):
    """A collision and its numbers."""

    result: Result
    summary: Summary


class Session:
    """A scenario that answers to changes of its values.

    Everything that is shown is computed from the whole scenario as ``trainmj run`` would, with the same numbers.

    Attributes:
        name: by which a file of it is called.
        base: the scenario as its file states it.
        given: changes that are made from the start.
        start: the scenario with these.
    """

    def __init__(
        self, name: str, base: Scenario, given: Mapping[str, Any], command: Callable[[Mapping[str, Any]], str]
    ) -> None:
        """Nothing computed yet.

        Args:
            name: by which a file of it is called.
            base: the scenario as its file states it.
            given: changes that are made from the start.
            command: the command line that computes the scenario with changes.

        Raises:
            InputError: if the changes break a rule.
        """
        self.name = name
        self.base = base
        self.given = {_short(base, name): value for name, value in given.items()}
        self._command = command
        self._kept: dict[str, Seen] = {}
        self._lock = Lock()
        self.start = self._changed({})
        refuse(idle_held([self.start], self.given))

    @cached_property
    def values(self) -> dict[str, Any]:
        """The numbers that may be changed: those that have a slider from the start, all others, and curves."""
        numbers, curves = values_of(self.start)
        parameters = parameters_of(self.start, numbers)
        named = {path for one in parameters for path in self.start.paths(one.name)}
        known = {one.name: one for one in numbers}
        wanted = dict.fromkeys((*self.given, _ALWAYS))  # beside what has a short name
        shown = [*parameters, *(known[name] for name in wanted if name in known and name not in named)]
        others = [one for one in numbers if one.name not in named and one not in shown]
        return {
            "parameters": [one.as_dict() for one in shown],
            "others": [one.as_dict() for one in others],
            "curves": [one.as_dict() for one in curves],
        }

    def answer(self, changes: Values, last: str = "", wanted: Collection[str] | None = None) -> str:
        """What a change of values does, as JSON.

        Args:
            changes: new values by path or parameter, over those that were given from the start.
            last: name of the value that was changed last, to which a message belongs that names none.
            wanted: titles of the sections that are looked at, and NUMBERS; all by default.

        Returns:
            ``{"shown": {...}}``, or ``{"wrong": {name: message}}`` with the name empty where it belongs to none.
        """
        try:
            if last in changes:
                self._check_effect(last, changes)
            return f'{{"shown":{self.told(self.computed(changes), changes, wanted)}}}'
        except TrainmjError as error:
            return json.dumps({"wrong": self._wrong(error, changes, last)})

    def saved(self, changes: Values) -> str:
        """The scenario with changes as one self-contained YAML file, as JSON like an answer: ``{"yaml": "..."}``."""
        try:
            return json.dumps({"yaml": to_yaml(self._changed(changes))})
        except TrainmjError as error:
            return json.dumps({"wrong": self._wrong(error, changes, "")})

    def _changed(self, changes: Values) -> Scenario:
        every = {**self.given, **changes}
        return self.base.with_values(every) if every else self.base

    def _check_effect(self, name: str, changes: Values) -> None:
        """Refuse a value that has no effect beside the others.

        Raises:
            InputError: with its name, and what takes its place.
        """
        others = {other: [value] for other, value in changes.items() if other != name}
        refuse(idle([self._changed(changes)], [{name: [changes[name]]}, others], [[name]], OF_MANY))

    def _wrong(self, error: TrainmjError, changes: Values, last: str) -> dict[str, str]:
        """The lines of a message, each at the value that it names."""
        found: dict[str, list[str]] = {}
        for line in printable(str(error)).splitlines():
            named = (name for name in changes if any(_names(line, one) for one in (name, *self.base.paths(name))))
            found.setdefault(next(named, last if last in changes else ""), []).append(line)
        return {name: "\n".join(lines) for name, lines in found.items()}

    def computed(self, changes: Values) -> Seen:
        """The collision with changes; the last few are kept, of which more may be asked.

        Raises:
            InputError: if they break a rule.
        """
        key = json.dumps(changes, sort_keys=True)
        with self._lock:
            if key in self._kept:
                return self._kept[key]
        result = run(self._changed(changes))
        seen = Seen(result, summarise(result))
        with self._lock:
            self._kept[key] = seen
            while len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
        return seen

    def told(self, seen: Seen, changes: Values, wanted: Collection[str] | None = None) -> str:
        """What is shown of a collision, as JSON; arguments as of :meth:`answer`."""
        scenario, summary = seen.result.scenario, seen.summary
        found = subjects(thinned(seen.result), summary)
        told: dict[str, Any] = {
            "subject": scenario.subject,
            "changed": f"changed: {scenario.changes}" if scenario.changes else "",
            "status": _status(summary),
            "key": [
                f"{quantity.key} {quantity.text(summary.values[quantity.name])} {quantity.unit}" for quantity in _KEY
            ],
            "command": self._command({**self.given, **changes}),
            "titles": list(found),
        }
        if wanted is None or NUMBERS in wanted:
            told["numbers"] = _numbers(summary)
        sections = []
        for title, add in found.items():
            if wanted is None or title in wanted:
                add(section := Section(title, ""))
                sections.append(_section(section))
        return f'{json.dumps(told)[:-1]},"sections":[{",".join(sections)}]}}'


def thinned(result: Result, most: int = _SAMPLES) -> Result:
    """A result with records farther apart, for pictures; tally and tables are those of every step.

    Where occupants fly freely all records are kept, from which their flights follow.
    """
    step = -(-len(result.time) // most)
    if step == 1 or result.chain.free_flights:
        return result
    chain: Chain = replace(result.chain, steps_per_record=result.chain.steps_per_record * step)
    return replace(result, chain=chain, **{name: getattr(result, name)[::step] for name in ("time", *HISTORIES)})


def _section(section: Section) -> str:
    """A section as JSON: what is fixed as HTML, and what scripts draw as data."""
    fixed = fragment(block for block in section.blocks if block.kind != "plot" and not block.script)
    plots = ",".join(_plot(block.content) for block in section.blocks if block.kind == "plot")
    data = next((block.data for block in section.blocks if block.data), "null")
    title, html = json.dumps(section.title), json.dumps(str(fixed))
    return f'{{"title":{title},"html":{html},"plots":[{plots}],"animation":{data}}}'


def _plot(content: Mapping[str, Any]) -> str:
    told = {name: content[name] for name in ("title", "note", "height")}
    return f'{json.dumps(told)[:-1]},"figure":{content["figure"]}}}'


def _status(summary: Summary) -> dict[str, Any]:
    """How it ended, as every place says it where numbers stand."""
    kind = summary.status.kind
    verdict = failed(kind.value) if summary.not_valid else outcome(kind)
    limits = summary.limits
    return {
        **_said(verdict),
        "not_valid": summary.not_valid,
        "why": why_not_valid(summary) if summary.not_valid else summary.status.reason or MEANING[kind],
        "limits": f"{sum(c.kept for c in limits)} of {len(limits)} limits kept" if limits else "no limits stated",
    }


def _said(verdict: Verdict) -> dict[str, str]:
    return {"kind": verdict.kind, "sign": verdict.sign, "text": verdict.text}


def _numbers(summary: Summary) -> list[dict[str, Any]]:
    """What variants are compared by: criteria with their limits, then every response."""
    found: list[dict[str, Any]] = []
    for c in summary.limits:
        kept = Verdict("pass" if c.kept else "fail", f"of {c.limit:.12g}")
        where = f" ({c.where})" if c.where else ""
        one = {"name": f"limit {c.name}", "title": c.title, "unit": c.unit, "text": f"{c.text}{where}"}
        found.append(one | {"verdict": _said(kept)})
    for name, column in summary.columns.items():
        text = in_digits(summary.responses[name], column.digits)
        found.append({"name": name, "title": column.title, "unit": column.unit, "text": text})
    return found


def _names(line: str, name: str) -> bool:
    """Whether a message is about a value."""
    return re.search(rf"(^|[\s:]){re.escape(name)}( ?=|:|$)", line) is not None


def _short(scenario: Scenario, name: str) -> str:
    """The parameter that leads to just what a path leads to; any other name as it is."""
    if name in scenario.parameters:
        return name
    return next((short for short in scenario.parameters if scenario.paths(short) == (name,)), name)
