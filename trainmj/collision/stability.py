"""Largest step at which the integration of a chain is stable; a larger one is refused."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from trainmj.collision import stability_plane as plane
from trainmj.collision.chain import WALL, Chain
from trainmj.collision.envelope import Array
from trainmj.errors import InputError
from trainmj.symbol import case_by_case
from trainmj.units import MS, rounded_down

_ROUNDING = 1e-9  # of a largest step
_LATE = 2.0  # times that the stiffness of what pushes only counts in the largest step


def largest_step(chain: Chain) -> float:
    """Largest stable step of a chain [s].

    The semi-implicit Euler step with an explicit dashpot is stable where h2 K / 4 + h C / 2 < M in the sense of
    matrices, with masses M and every device and member at its stiffest: K and C are sums over what acts between two
    points. For a single oscillator that is h = 2 (sqrt(1 + z2) - z) / w. A device, which pushes only, is met up to a
    step late, h v deep, and turns v into v (1 - h2 K / M - h C / M): not faster than v if its stiffness counts twice.
    What resists the speed, such as an orifice, is taken at the speed at which the two sides close.
    """
    if chain.plane:
        return _largest(*plane.matrices(chain))
    links = list(_links(chain))
    stated = [[link[n] for link in links] for n in (2, 3)]
    found: float = case_by_case(partial(_along, tuple(link[:2] for link in links)), chain.point_mass, *stated)
    return found


def _largest(stiffness: Array, damping: Array) -> float:
    """The same of a stiffness and damping over the roots of the masses."""
    # with m = 1 / h, (m2 - m C / 2 - K / 4) x = 0: a symmetric problem of twice the size, by K / 4 = R R'
    squares, shapes = np.linalg.eigh(0.25 * stiffness)
    root = shapes * np.sqrt(np.maximum(squares, 0.0))
    both = np.block([[0.5 * damping, root], [root.T, np.zeros_like(root)]])
    return float(1.0 / np.linalg.eigvalsh(both)[-1])


def _along(ends: Sequence[tuple[int, int]], mass: Array, *stated: Array) -> float:
    """The same along the track, of masses and of what acts between each two points or one and the wall."""
    root = np.sqrt(mass)
    matrices = []
    for values in stated:
        matrix = np.zeros((mass.size, mass.size))
        for (left, right), value in zip(ends, values, strict=True):
            matrix[left, left] += value
            if right != WALL:
                matrix[right, right] += value
                matrix[left, right] -= value
                matrix[right, left] -= value
        matrices.append(matrix / np.outer(root, root))
    return _largest(*matrices)


def _links(chain: Chain) -> Iterator[tuple[int, int, float, float]]:
    """What acts between two points, or one and the wall: their indices, stiffness that counts, largest damping."""
    for interface in chain.interfaces:
        stiffness, damping = interface.bounds(chain.closing_speed)
        yield *chain.ends(interface), _LATE * stiffness, damping
    for member in chain.members:
        yield member.left, member.right, member.stiffness, member.damping


def is_stable(chain: Chain) -> bool:
    """Whether the step is stable for certain, found at once.

    In the vertical plane by Gershgorin's circles around what acts. Along the track the matrix M - h C / 2 - h2 K / 4 is
    positive definite where all pivots of its elimination are positive; the order of the points leaves few of its places
    filled.
    """
    if chain.plane:
        k, c = plane.bounds(chain)
        return bool(chain.step <= 2.0 / (0.5 * c + np.sqrt(0.25 * c**2 + k)))
    h = chain.step / (1.0 + _ROUNDING)
    own = chain.point_mass.tolist()
    beside: list[dict[int, float]] = [{} for _ in own]  # of each point and those behind it
    for left, right, k, c in _links(chain):
        pushed = 0.25 * h * h * k + 0.5 * h * c
        for point in (left, right):
            if point != WALL:
                own[point] = own[point] - pushed
        if right != WALL:
            first, second = min(left, right), max(left, right)
            beside[first][second] = beside[first].get(second, 0.0) + pushed
    for pivot, row in zip(own, beside, strict=True):
        if not pivot > 0.0:
            return False
        behind = sorted(row)
        for n, i in enumerate(behind):
            share = row[i] / pivot
            own[i] = own[i] - share * row[i]
            for j in behind[n + 1 :]:
                beside[i][j] = beside[i].get(j, 0.0) - share * row[j]
    return True


def check_step(chain: Chain) -> None:
    """Refuse a step at which the integration is not stable.

    Raises:
        InputError: naming the largest step.
    """
    if is_stable(chain):
        return
    limit = largest_step(chain)
    if chain.step > limit * (1.0 + _ROUNDING):
        raise InputError(
            f"simulation.step_ms = {chain.step / MS:.12g}: must be at most {rounded_down(limit / MS, 3)} ms for the "
            "stiffness and damping of these devices and bodies and the mass of these vehicles, or the integration is "
            "unstable"
        )
