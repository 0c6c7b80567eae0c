"""A case of an assessment with what was found, and one criterion in it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from trainmj.assessment.plan import Case
from trainmj.collision.chain import WALL
from trainmj.collision.limits import Criterion
from trainmj.collision.measured import convertible, spread
from trainmj.collision.status import Kind
from trainmj.collision.summary import Summary
from trainmj.units import KM_H

_LEFT, _CLOSING_KM_H = 0.01, 1.0  # of the convertible energy, and how fast vehicles may close, where a run is cut off


@dataclass(frozen=True, eq=False)
class Outcome:
    """A case with what was found.

    Attributes:
        case: that was computed.
        summary: of its collision; None if it could not be made.
    """

    case: Case
    summary: Summary | None = field(repr=False)

    @property
    def status(self) -> str:
        """How it ended, in words."""
        return str(self.summary.status) if self.summary else f"{Kind.REFUSED}: {self.case.refused}"

    @property
    def fault(self) -> str:
        """Why the case is not passed whatever its criteria say; empty if nothing else is wrong with it."""
        if self.summary is None or self.summary.status.unusable or self.summary.status.kind is Kind.NO_CONTACT:
            return self.status
        crushed = self.summary.gave_way
        said = [f"car bodies gave way at {', '.join(crushed)}"] if crushed else []
        return "; ".join(said + ([f"cut off by the time limit, {closing}"] if (closing := self._closing) else []))

    @property
    def cut(self) -> bool:
        """Whether the collision was not over at the time limit."""
        return self.summary is not None and not self.summary.over

    @property
    def _closing(self) -> str:
        """What was still to come when the collision was cut off, with the cure; empty where nothing to speak of was."""
        summary, chain = self.summary, self.case.chain
        if not (self.cut and summary and chain):
            return ""
        at_end = {v.name: v.final_speed_km_h for v in summary.vehicles}
        speed = np.array([at_end[v.name] for v in chain.vehicles])
        ahead = np.append(speed, 0.0)[[i.right for i in chain.interfaces]]  # nothing moves at a wall, which is the last
        walled = chain.interfaces[-1].right == WALL
        fastest = int(np.argmax(closing := speed[[i.left for i in chain.interfaces]] - ahead))
        if closing[chain.front] > 0.0:
            left = float(convertible(walled, chain.mass, speed * KM_H))
        else:  # the sides part, and what is left is what moves within each
            left = sum(
                float(spread(chain.mass[side], speed[side] * KM_H))
                for side in (slice(chain.n_moving), slice(chain.n_moving, None))
            )
        left /= float(convertible(walled, chain.mass, chain.speed))
        if left <= _LEFT or closing[fastest] <= _CLOSING_KM_H:
            return ""
        return (
            f"while {chain.interfaces[fastest].name} closed at {closing[fastest]:.1f} km/h and {100 * left:.0f} % of "
            "the energy that the collision can convert was left: state a longer simulation.time_limit_s"
        )


@dataclass(frozen=True)
class Row:
    """One criterion in one case.

    Attributes:
        outcome: the case.
        criterion: with value and limit; the limit of a response that is only reported is infinite.
    """

    outcome: Outcome
    criterion: Criterion

    @property
    def judged(self) -> bool:
        """Whether there is a limit."""
        return self.criterion.limit < math.inf

    @property
    def margin(self) -> float:
        """What is left of the limit [%]; negative where it is passed."""
        return 100.0 - self.criterion.used

    @property
    def rank(self) -> tuple[bool, float]:
        """Grows with how bad it is: not kept, then how much of the limit is used, or the value."""
        value = self.criterion.used if self.judged else abs(self.criterion.found)
        return not self.criterion.kept, math.inf if math.isnan(value) else value
