"""What must be said on a picture from some time on: numbers are not valid, a limit is passed, a car body gives way."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from trainmj.collision.chain import Chain, n_own_sides, places_of_sides
from trainmj.collision.device import CAR_BODY, Stage
from trainmj.collision.result import Result
from trainmj.collision.status import NOT_VALID, Kind
from trainmj.collision.summary import summarise
from trainmj.collision.wear import GIVEN, Wear
from trainmj.units import MM, beyond

_TOLD = 3  # places that one line names


class Warnings:
    """What a collision has come to so far.

    The strokes of stages and bodies are followed as they pass their limits. Other limits, such as that of a mean
    deceleration, are judged when the collision is over, and said then.

    Attributes:
        lines: how many there are to say at most.
    """

    def __init__(self, result: Result) -> None:
        """Find what there will be to say."""
        self._chain = result.chain
        summary = summarise(result)
        status = summary.status
        self._until, self._valid = result.tally.valid_until, ""
        if status.kind in NOT_VALID:
            self._valid = f"{result.not_valid}: {status.kind} at {_listed(status.where, ', ')}"
        self._pending = dict(_judged(result.chain))
        self._passed: dict[str, tuple[float, list[str]]] = {}  # what, since when, and where
        self._end, self._late = float(result.time[-1]), ""
        if status.kind == Kind.LIMIT:
            self._late = f"limit passed: {_listed([c.said for c in summary.limits if c.of_scenario and not c.kept])}"
        elif status.kind == Kind.EXHAUSTED:
            self._late = f"{status.kind}: {_listed(status.where, ', ')}"
        self.lines = 2 if self._valid else int(bool(self._late))

    def follow(self, time: float, wear: Wear) -> None:
        """See what has been passed at a time [s]."""
        for (k, side, n), (limit, said) in list(self._pending.items()):
            if beyond(wear.worn[k, side].used[n], limit):
                self._add(time, *said)
                del self._pending[k, side, n]
        for member, plastic in zip(self._chain.members, wear.plastic, strict=True):
            if member.span and abs(plastic) > GIVEN and (self._chain.twin or member.vehicle < self._chain.n_moving):
                self._add(time, "car body gives way: ", self._chain.vehicles[member.vehicle].name)

    def _add(self, time: float, what: str, where: str) -> None:
        places = self._passed.setdefault(what, (time, []))[1]
        if where not in places:
            places.append(where)

    def said(self, time: float) -> list[str]:
        """What there is to say at a time [s], in one line or two."""
        lines = [self._valid] if self._valid and time >= self._until else []
        passed = [
            f"{what}{_listed(places, ', ')} ({'from ' if len(places) > 1 else ''}{since:.3f} s)"
            for what, (since, places) in sorted(self._passed.items(), reverse=True)  # limits first
        ]
        if passed:
            lines.append(_listed(passed))
        elif self._late and time >= self._end:
            lines.append(self._late)
        return lines


def _judged(chain: Chain) -> Iterator[tuple[tuple[int, int, int], tuple[float, tuple[str, str]]]]:
    """Every stage that has a limit, or is a car body, where limits count: its place, the limit [m], and what to say."""
    places = places_of_sides(chain)
    for k, side in places if chain.twin else places[: n_own_sides(chain)]:
        interface = chain.interfaces[k]
        stages = [stage for path in interface.paths(side) for stage in path.stages]
        for n, stage in enumerate(stages):
            if stage.name == CAR_BODY:
                yield (k, side, n), (GIVEN, ("car body gives way: ", interface.sides[side]))
            elif math.isfinite(stage.limit):
                yield (k, side, n), (stage.limit, _past(interface.sides[side], stage, len(stages)))


def _past(where: str, stage: Stage, n: int) -> tuple[str, str]:
    return f"stroke limit of {stage.limit / MM:.6g} mm passed: ", f"{where} {stage.name}" if n > 1 else where


def _listed(words: Sequence[str], between: str = "; ") -> str:
    more = len(words) - _TOLD
    return between.join(words[:_TOLD]) + (f" and {more} more" if more > 0 else "")
