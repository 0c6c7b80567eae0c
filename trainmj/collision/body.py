"""Bodies that give: a vehicle as point masses in a row, with members between them that shorten, and collapse.

A uniform bar of mass M and axial stiffness k = EA / L becomes N members of stiffness N k between N + 1 points, those
at the ends of half the mass. Free, it swings at::

    omega_j = 2 N sqrt(k / M) sin(j pi / 2 N)        of the bar: j pi sqrt(k / M)

The dashpots beside the springs give the lowest of these the stated damping ratio. A member yields where spring and
dashpot together reach the collapse force, in compression or in tension, and hardens with its plastic travel: where it
shortens plastically by p, the force has risen by N h p, so that a body that collapses evenly follows the slope h over
its whole plastic shortening.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.collision.fields import MEMBER, Block
from trainmj.collision.jitable import jitable
from trainmj.symbol import square_root

SURVIVAL_LENGTH = 5.0
"""Plastic shortening is looked at over this length along a body, as a proxy of survival space [m]."""


@dataclass(frozen=True)
class Bogies:
    """Two bogies below a body, each a mass on a stiff longitudinal link.

    Attributes:
        mass: of each [kg].
        stiffness: of each link [N/m].
        damping: of each link [N s/m].
        centres: distance between them [m].
    """

    mass: float
    stiffness: float
    damping: float
    centres: float


@dataclass(frozen=True)
class Body:
    """The body of a vehicle, from left to right.

    Attributes:
        stiffness: EA / L [N/m].
        damping_ratio: of the lowest axial mode.
        n_members: in a row.
        collapse: force at which it collapses [N]; infinite for a body that stays elastic.
        hardening: slope of that force over the plastic shortening of the whole body [N/m].
        attached: distance from the left and from the right end to the point at which devices attach [m].
        bogies: below it, if they are masses of their own.
    """

    stiffness: float
    damping_ratio: float = 0.0
    n_members: int = 4
    collapse: float = math.inf
    hardening: float = 0.0
    attached: tuple[float, float] = (0.0, 0.0)
    bogies: Bogies | None = None

    def own(self, mass: float) -> float:
        """What a vehicle of some mass has without its bogies [kg]."""
        return mass - (2 * self.bogies.mass if self.bogies else 0.0)

    def frequency(self, mass: float, mode: int = 1) -> float:
        """Frequency of an axial mode of the free body of some mass, bogies left out [Hz]."""
        n = self.n_members
        return n / math.pi * square_root(self.stiffness / mass) * math.sin(mode * math.pi / (2 * n))


@dataclass(frozen=True)
class Point:
    """A point mass of a chain: a vehicle, or a part of one.

    Attributes:
        name: M1, M1 2, M1 bogie 1; those of a body are counted from the end that faces the impact.
        vehicle: index of its vehicle.
        order: among the points of its vehicle: from the end that faces the impact, bogies last.
        mass: [kg].
        carried: share of the weight of its vehicle that its wheels carry.
        place: distance from the left end of the vehicle [m].
    """

    name: str
    vehicle: int
    order: int
    mass: float
    carried: float
    place: float


@dataclass(frozen=True)
class Member:
    """A member of a body, or the link of a bogie.

    Attributes:
        name: M1 member 2, M1 bogie 1; counted from the end that faces the impact.
        vehicle: index of its vehicle.
        order: among the members of its vehicle, as points are.
        left: index of the point on its left, or of the body's.
        right: index of the point on its right, or of the bogie.
        stiffness: [N/m].
        damping: [N s/m].
        collapse: force at which it yields [N]; infinite if it does not.
        hardening: slope of that force over its own plastic travel [N/m].
        span: its part of the body, from and to a distance from the left end [m]; none of a bogie.
    """

    name: str
    vehicle: int
    order: int
    left: int
    right: int
    stiffness: float
    damping: float
    collapse: float = math.inf
    hardening: float = 0.0
    span: tuple[float, float] | None = None

    @property
    def length(self) -> float:
        """Of its part of the body [m]; infinite of a bogie, whose link has none."""
        return self.span[1] - self.span[0] if self.span else math.inf


def points_of(name: str, vehicle: int, mass: float, length: float, body: Body | None, facing: int) -> Iterator[Point]:
    """The points of a vehicle from left to right, then its bogies.

    Args:
        name: of the vehicle.
        vehicle: its index.
        mass: [kg].
        length: [m].
        body: if it gives.
        facing: the end that faces the impact: 0 left, 1 right.
    """
    if body is None:
        yield Point(name, vehicle, 0, mass, 1.0, length / 2)
        return
    n = body.n_members
    bogies, own = body.bogies, body.own(mass)
    for i in range(n + 1):
        part = own / n * (0.5 if i in (0, n) else 1.0)
        order = n - i if facing else i
        yield Point(f"{name} {order + 1}", vehicle, order, part, 0.0 if bogies else part / mass, length * i / n)
    if bogies:
        for side in (0, 1):
            place = 0.5 * length + (side - 0.5) * bogies.centres
            order = int(side != facing)
            yield Point(f"{name} bogie {order + 1}", vehicle, n + 1 + order, bogies.mass, 0.5, place)


def members_of(name: str, vehicle: int, mass: float, length: float, body: Body, facing: int) -> Iterator[Member]:
    """The members of a body from left to right, then the links of its bogies; points are counted within the vehicle.

    The arguments are those of :func:`points_of`.
    """
    n = body.n_members
    stiffness = n * body.stiffness
    damping = 2.0 * body.damping_ratio * stiffness / (2.0 * math.pi * body.frequency(body.own(mass)))
    for i in range(n):
        order = n - 1 - i if facing else i
        span = (length * i / n, length * (i + 1) / n)
        yield Member(
            f"{name} member {order + 1}",
            vehicle,
            order,
            i,
            i + 1,
            stiffness,
            damping,
            body.collapse,
            n * body.hardening,
            span,
        )
    if body.bogies:
        for side in (0, 1):
            at = nearest(body, length, 0.5 * length + (side - 0.5) * body.bogies.centres)
            order = int(side != facing)
            link = f"{name} bogie {order + 1}"
            yield Member(link, vehicle, n + order, at, n + 1 + side, body.bogies.stiffness, body.bogies.damping)


def nearest(body: Body, length: float, place: float) -> int:
    """The point of a body nearest to a place along it [m], counted from the left."""
    return min(max(round(place / length * body.n_members), 0), body.n_members)


@jitable
def strain(s: Block, m: int, stroke: float, rate: float, elapsed: float) -> float:
    """Move a member to a shortening; its force, of spring and dashpot [N].

    Both act on the elastic part of the shortening, and together never carry more than the member yields at.
    """
    stiffness, damping, hardening = s[m + MEMBER.STIFFNESS], s[m + MEMBER.DAMPING], s[m + MEMBER.HARDENING]
    plastic, before = s[m + MEMBER.PLASTIC], s[m + MEMBER.RATE]
    force = stiffness * (stroke - plastic) + damping * rate
    limit = s[m + MEMBER.COLLAPSE] + hardening * s[m + MEMBER.TRAVEL]
    if abs(force) > limit:
        dashpot = damping / elapsed if elapsed > 0.0 else 0.0
        travel = (abs(force) - limit) / (stiffness + hardening + dashpot)
        s[m + MEMBER.DISSIPATED] += (limit + 0.5 * hardening * travel) * travel
        s[m + MEMBER.TRAVEL] += travel
        force = math.copysign(limit + hardening * travel, force)
        travel = math.copysign(travel, force)
        plastic += travel
        rate -= travel / elapsed if elapsed > 0.0 else 0.0
        s[m + MEMBER.PLASTIC] = plastic
    viscous = 0.5 * damping * before * (before + rate) * elapsed
    s[m + MEMBER.VISCOUS] += viscous
    s[m + MEMBER.DISSIPATED] += viscous
    s[m + MEMBER.STROKE], s[m + MEMBER.RATE] = stroke, rate
    s[m + MEMBER.FORCE] = stiffness * (stroke - plastic)
    s[m + MEMBER.STROKE_MAX] = max(s[m + MEMBER.STROKE_MAX], stroke)
    s[m + MEMBER.FORCE_MAX] = max(s[m + MEMBER.FORCE_MAX], abs(force))
    return force


def yielded(members: Sequence[Member], travel: Array) -> Array:
    """Energy that members have lost by yielding (..., n_member) [J], by their plastic travel (..., n_member) [m]."""
    collapse = np.array([m.collapse if m.collapse < math.inf else 0.0 for m in members])
    hardening = np.array([m.hardening for m in members])
    return np.asarray((collapse + 0.5 * hardening * travel) * travel)


def plastic_over(spans: list[tuple[float, float]], plastic: list[float], length: float = SURVIVAL_LENGTH) -> float:
    """Largest plastic shortening within a length of a body [m], each member's spread evenly over its part.

    Args:
        spans: of the members, end to end [m].
        plastic: shortening of each [m].
        length: [m]; a shorter body counts as a whole.
    """
    edges = np.array([spans[0][0], *(end for _, end in spans)])
    whole = np.concatenate([[0.0], np.cumsum(plastic)])
    starts = np.clip(np.concatenate([edges, edges - length]), edges[0], max(edges[0], edges[-1] - length))
    return float(np.max(np.interp(starts + length, edges, whole) - np.interp(starts, edges, whole)))
