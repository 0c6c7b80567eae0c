"""What is drawn along a body that gives, from the end that faces the impact."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trainmj.collision.chain import order_of_vehicles
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


def along(result: Result, one: Along) -> dict[str, tuple[Array, Array]]:
    """A quantity along every body that gives, by the name of its vehicle, in the order of the tables.

    Returns:
        (n_member + 1,) distances from the end that faces the impact [m], and values there. Values of members are by
        their length at rest, each from its distance to the next one, so that the last one stands twice. Bogies are left
        out.
    """
    chain, found = result.chain, {}
    for i in order_of_vehicles(chain):
        vehicle = chain.vehicles[i]
        if vehicle.body is not None:
            n = vehicle.body.n_members
            values = getattr(result.tally, one.tallied) / one.factor
            if one.of_members:
                order = chain.members_inward(i)[:n]
                y = values[[*order, order[-1]]] * n / vehicle.length
            else:
                y = values[chain.points_inward(i)[: n + 1]]
            found[vehicle.name] = np.linspace(0.0, vehicle.length, n + 1), y
    return found
