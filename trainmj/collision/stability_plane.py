"""The largest step in the vertical plane: what acts there, as rows of a stiffness matrix."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from trainmj.collision.chain import WALL, Chain, Interface
from trainmj.collision.envelope import Array
from trainmj.collision.gear import N_DOF, PITCH, SUSPENDED, WHEELS, Gear, X, Z
from trainmj.collision.line import Line

_LATE = 2.0
"""Times that the stiffness of what only pushes counts, as it is met up to a step late."""

Row = tuple[dict[int, Array], float, float]
"""By vehicle, what its degrees of freedom add to a stroke; stiffness that counts; damping."""


def matrices(chain: Chain) -> tuple[Array, Array]:
    """(n_dof, n_dof) stiffness and damping over the roots of the masses, where the vehicles stand as designed."""
    n = chain.first_dof[-1]
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    for by_vehicle, k, c in _rows(chain):
        stroke = np.zeros(n)
        for i, part in by_vehicle.items():
            stroke[chain.first_dof[i] : chain.first_dof[i + 1]] = part
        stiffness += k * np.outer(stroke, stroke)
        damping += c * np.outer(stroke, stroke)
    return stiffness, damping


def bounds(chain: Chain) -> tuple[float, float]:
    """Bounds of their largest eigenvalues: Gershgorin's circles around what acts."""
    found = _rows(chain)
    k, c = np.sqrt([k for _, k, _ in found]), np.sqrt([c for _, _, c in found])
    beside = np.zeros((2, len(found)))
    for i in range(len(chain.vehicles)):
        own = [n for n, (by_vehicle, _, _) in enumerate(found) if i in by_vehicle]
        strokes = np.array([found[n][0][i] for n in own])
        coupled = np.abs(strokes @ strokes.T)
        beside[:, own] += coupled @ k[own], coupled @ c[own]
    return float(np.max(k * beside[0])), float(np.max(c * beside[1]))


def _rows(chain: Chain) -> list[Row]:
    """All that acts, over degrees of freedom of which the kinetic energy is half the sum of the squares."""
    found = []
    for by_vehicle, stiffness, damping in _of_devices(chain):
        scaled = {}
        for i, stroke in by_vehicle.items():
            v = chain.vehicles[i]
            scaled[i] = stroke[:1] / np.sqrt(v.mass) if v.gear is None else _root(v.gear) @ stroke
        found.append((scaled, stiffness, damping))
    for i, vehicle in enumerate(chain.vehicles):
        if vehicle.gear is not None:
            found += [({i: stroke}, stiffness, damping) for stroke, stiffness, damping in _of_gear(vehicle.gear)]
    return found


@lru_cache(maxsize=1024)
def _root(gear: Gear) -> Array:
    """(11, 11) inverse of the triangular root of the mass matrix, where the vehicle stands as designed."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(gear.mass_matrix(np.zeros(N_DOF)))))


def _of_devices(chain: Chain) -> Iterator[Row]:
    for interface in chain.interfaces:
        for element in interface.elements:
            assert element.line is not None  # every element in the plane has one
            stiffness, damping = element.bounds(chain.closing_speed)
            line = element.line
            yield _across(chain, interface, line, X), _LATE * stiffness, damping
            if line.tie:
                yield _across(chain, interface, line, Z), line.tie, 0.0
            if line.strut:
                yield from _swings(chain, interface, line)


def _swings(chain: Chain, interface: Interface, line: Line) -> Iterator[Row]:
    length = line.left.pin + line.right.pin
    for i, stiffness in ((interface.left, line.left.swing), (interface.right, line.right.swing)):
        if i != WALL and stiffness:
            turned = {k: -stroke / length for k, stroke in _across(chain, interface, line, Z).items()}
            turned[i][PITCH] -= 1.0
            yield turned, _LATE * stiffness, 0.0


def _across(chain: Chain, interface: Interface, line: Line, axis: int) -> dict[int, Array]:
    """How much farther the left point of a line is than the right one, along the track (X) or upwards (Z)."""
    found = {}
    for i, end, sign in ((interface.left, line.left, 1.0), (interface.right, line.right, -1.0)):
        if i == WALL:
            continue
        stroke = np.zeros(N_DOF)
        stroke[axis] = sign
        ahead, above = chain.point_of_line(i, int(i == interface.left), end)
        stroke[PITCH] = sign * (ahead if axis == Z else -above)
        found[i] = stroke
    return found


@lru_cache(maxsize=1024)
def _of_gear(gear: Gear) -> list[tuple[Array, float, float]]:
    """Rails below the wheelsets of a vehicle, and its suspensions with their stops."""
    root, wheels = _root(gear), gear.placed(np.zeros(N_DOF)).up[WHEELS]
    found = [(root @ up, _LATE * gear.rail_stiffness, gear.rail_damping) for up in wheels]
    for dof in SUSPENDED:
        suspension = gear.suspension(dof)
        found.append((root[:, dof], suspension.stiffness + _LATE * suspension.stop, suspension.damping))
    return found
