"""What a kind of device law consists of, and a law of a kind with its numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.fields import N_PARAMETER

if TYPE_CHECKING:
    from trainmj.collision.device import Device

Response = tuple[float, float, float, float, float]
"""Force [N], the two states after the step, energy lost in it and the part of that lost by speed [J]."""


class Numbers(Protocol):
    """The numbers of one law, or of many laws of a kind side by side.

    Attributes:
        parameters: a number each, or an array of those of all laws.
        curves: strokes, values and slopes (3, n), or (3, ..., n), of each curve.
    """

    @property
    def parameters(self) -> Sequence[Any]:
        """In the order of the kind."""

    @property
    def curves(self) -> Sequence[Array]:
        """In the order of the kind."""


@dataclass(frozen=True)
class Kind:
    """A kind of law.

    Attributes:
        name: as scenario files call it.
        respond: the law, ``respond(s, e, stroke, rate, elapsed)``: in a block s, of the element whose fields begin at
            e, for a stroke [m] at the end of a step, its rate [m/s] and the duration of the step [s]. It reads the
            element as the step before left it and changes nothing but segments of curves and the PEAK, so that it may
            be asked for several strokes. It is compiled as it stands.
        device: the device that a part of a scenario describes, ``device(name, spec, parts)``.
        stored: energy that it holds and gives back [J], of the numbers of a law, its stroke, force and two states; of
            many laws at once as of one, element by element.
        permanent: stroke that remains without force [m], of the numbers of a law and its two states, likewise.
        bounds: of a law and a largest rate [m/s]: largest dF/du [N/m] and dF/drate [N s/m], for the largest step.
        loss: how the books call what it loses other than by speed.
        store: how they call what it holds.
        follows: whether what it absorbed at rest is the area below its curve.
    """

    name: str
    respond: Callable[..., Response]
    device: Callable[..., Device]
    stored: Callable[..., Array]
    bounds: Callable[..., tuple[float, float]]
    permanent: Callable[..., Array]
    loss: str = "crushed"
    store: str = "elastic"
    follows: bool = False

    def __repr__(self) -> str:
        """Give its name."""
        return self.name


@dataclass(frozen=True, eq=False)
class Law:
    """A kind of law with its numbers.

    Attributes:
        kind: what it is.
        parameters: as many as the kind has, in its order; SI.
        curves: (3, n) strokes, values and slopes behind the points, of each curve.
        loading: the curve of first loading at rest, with the stiffness along which it unloads.
        speeds: of all curves but the first, where these are one curve at several speeds [m/s].
        end: stroke at which its curve ends, where nothing is stated behind it [m]; otherwise infinite.
    """

    kind: Kind
    parameters: tuple[float, ...]
    curves: tuple[Array, ...]
    loading: Envelope
    speeds: tuple[float, ...] = ()
    end: float = np.inf

    def __post_init__(self) -> None:
        """Fill up the parameters."""
        filled = (*self.parameters, *[0.0] * (N_PARAMETER - len(self.parameters)))
        object.__setattr__(self, "parameters", filled)

    @cached_property
    def packed(self) -> tuple[Array, ...]:
        """The first curve as the block has it, and all others one after the other, each behind its speed if it has one.

        See :mod:`trainmj.collision.law.curve`.
        """
        first, *others = (np.append(c.T.ravel(), np.inf) for c in self.curves)
        behind = zip(self.speeds, others, strict=True) if self.speeds else ((None, other) for other in others)
        second: list[Any] = [part for speed, other in behind for part in ([] if speed is None else [[speed]]) + [other]]
        return (first, np.concatenate(second)) if second else (first,)

    def is_like(self, other: Law) -> bool:
        """Whether the other one is the same law, number by number."""
        return self is other or (
            (self.kind, self.parameters, self.speeds, self.end)
            == (other.kind, other.parameters, other.speeds, other.end)
            and len(self.curves) == len(other.curves)
            and all(map(np.array_equal, self.curves, other.curves))
        )


def points(envelope: Envelope) -> Array:
    """(3, n) strokes, forces and slopes of an envelope."""
    return np.array([envelope.stroke, envelope.force, envelope.slope])
