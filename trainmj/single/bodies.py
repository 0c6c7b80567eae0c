"""What is drawn along a body that gives, from the end that faces the impact."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.units import MM, G


class Along(NamedTuple):
    """A quantity along a body."""

    title: str
    axis: str  # title of the axis of values
    unit: str
    of_members: bool  # whether it is of members, or of the points between them
    tallied: str  # name in the tally
    factor: float  # by which values are divided to be in the unit
    always: bool  # whether it is drawn where all values are 0, too


ALONG = (
    Along("Largest shortening along the body", "Shortening", "mm/m", True, "member_stroke_max", MM, True),
    Along("Plastic shortening along the body", "Plastic shortening", "mm/m", True, "member_plastic", MM, False),
    Along("Largest acceleration along the body", "Acceleration", "g", False, "point_peak", G, True),
)
"""What is drawn along bodies, in this order."""


def along(result: Result, vehicle: int, one: Along) -> tuple[Array, Array]:
    """A quantity along the body of a vehicle: distances from the end that faces the impact [m], and values.

    Of members (n + 1,) edges and (n,) values by their length at rest, of points (n + 1,) each; bogies are left out.
    """
    chain = result.chain
    body, length = chain.vehicles[vehicle].body, chain.vehicles[vehicle].length
    assert body is not None
    edges = np.linspace(0.0, length, body.n_members + 1)
    order = chain.members_inward(vehicle)[: body.n_members] if one.of_members else chain.points_inward(vehicle)
    values = getattr(result.tally, one.tallied)[order[: len(edges) - one.of_members]] / one.factor
    return edges, values / (length / body.n_members) if one.of_members else values
