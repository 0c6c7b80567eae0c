"""What collisions in the vertical plane left behind beside strokes and forces: positions, energies, momenta.

The energies are those of the vehicles as they stand, by the kinematics of :mod:`trainmj.collision.gear`; they owe
nothing to MuJoCo's own sums.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np

from trainmj.collision.block import Tallies
from trainmj.collision.chain import Chain, Vehicle
from trainmj.collision.elementwise import total
from trainmj.collision.envelope import Array, BoolArray
from trainmj.collision.gear import N_DOF, SUSPENDED, WHEELS, Gear, X
from trainmj.collision.lot import Lot


class InPlane:
    """The vertical plane of the collisions of a lot; arrays have an axis of the cases before all others."""

    def __init__(self, lot: Lot, tally: Tallies) -> None:
        """Look at a lot."""
        self._lot, self._chain, self._tally = lot, lot.chain, tally

    @cached_property
    def q(self) -> Array:
        """(n_case, n_vehicle, 11) degrees of freedom at the end [m, rad]; 0 where a vehicle has none."""
        return np.stack([getattr(self._tally, f"frame_q{k}") for k in range(N_DOF)], axis=-1)

    @cached_property
    def v(self) -> Array:
        """(n_case, n_vehicle, 11) their rates."""
        return np.stack([getattr(self._tally, f"frame_v{k}") for k in range(N_DOF)], axis=-1)

    @property
    def pitch(self) -> Array:
        """(n_case, n_vehicle) pitch of largest magnitude [rad], positive with the end that faces the impact up."""
        high, low = self._tally.frame_pitch_max, self._tally.frame_pitch_min
        facing = np.array([1.0 if self._chain.facing(i) else -1.0 for i in range(len(self._chain.vehicles))])
        return np.asarray(facing * np.where(high >= -low, high, low))

    @property
    def heave(self) -> Array:
        """(n_case, n_vehicle) rise of the centre of gravity of the body of largest magnitude [m]."""
        high, low = self._tally.frame_heave_max, self._tally.frame_heave_min
        return np.asarray(np.where(high >= -low, high, low))

    @property
    def lift(self) -> Array:
        """(n_case, n_wheelset) largest lift off the rail [m]."""
        return self._tally.wheel_lift_max

    @property
    def lift_time(self) -> Array:
        """(n_case, n_wheelset) when it was [s]; nan if it stayed on the rail."""
        return np.where(self._tally.wheel_lift_time < 0.0, np.nan, self._tally.wheel_lift_time)

    @cached_property
    def rest(self) -> Array:
        """(n_case, n_wheelset) load at rest [N]."""
        return self._lot.values(lambda chain: [chain.load(k) for k in range(len(chain.wheelsets))])

    @property
    def load(self) -> Array:
        """(n_case, n_wheelset) least load over that at rest."""
        return np.asarray(self._tally.wheel_load_min / self.rest)

    def of_vehicles(self, values: Array, worst: Callable[..., Array], without: float) -> Array:
        """(n_case, n_vehicle) worst of the wheelsets of each vehicle, or what stands for a vehicle without.

        Args:
            values: (n_case, n_wheelset) of the wheelsets.
            worst: of an array along an axis.
            without: stands for a vehicle that has none.
        """
        found = np.full((len(values), len(self._chain.vehicles)), without)
        owner = np.array([i for i, _ in self._chain.wheelsets], dtype=int)
        for i in np.unique(owner):
            found[:, i] = worst(values[:, owner == i], axis=-1)
        return found

    @property
    def _own(self) -> BoolArray:
        return np.array([i < self._chain.n_moving for i, _ in self._chain.wheelsets], dtype=bool)

    @property
    def own_lift(self) -> Array:
        """(n_case,) largest lift of a wheelset of the moving train [m]."""
        return np.asarray(self.lift[:, self._own].max(axis=-1))

    @property
    def own_load(self) -> Array:
        """(n_case,) least load of a wheelset of the moving train over that at rest."""
        return np.asarray(self.load[:, self._own].min(axis=-1))

    @property
    def own_step(self) -> Array:
        """(n_case,) largest step of an interface of the moving train, that at the front included [m]."""
        return np.asarray(self._tally.ends_step_max[:, : self._chain.front + 1].max(axis=-1))

    @cached_property
    def kinetic(self) -> Array:
        """(n_case,) kinetic energy at the end [J]."""
        return np.array([sum(energies) for energies in self._each(_kinetic)])

    @cached_property
    def momentum(self) -> Array:
        """(n_case,) momentum along the track at the end [N s]."""
        return np.array([sum(momenta) for momenta in self._each(_momentum)])

    @cached_property
    def raised(self) -> Array:
        """(n_case,) energy that weight, suspensions and rails hold at the end, more than at the start [J]."""
        return np.array([sum(energies) for energies in self._each(_raised)])

    def _each(self, of: Callable[[Vehicle, Array, Array], float]) -> Iterator[list[float]]:
        """What a function says of each vehicle, its degrees of freedom and their rates, case by case."""
        for vehicles, positions, rates in zip(self._vehicles, self.q, self.v, strict=True):
            yield [of(*one) for one in zip(vehicles, positions, rates, strict=True)]

    @cached_property
    def _chains(self) -> list[Chain]:
        return [self._lot.chain_of(case) for case in range(len(self._lot))]

    @property
    def _vehicles(self) -> list[tuple[Vehicle, ...]]:
        return [chain.vehicles for chain in self._chains]

    @cached_property
    def damped(self) -> Array:
        """(n_case,) energy lost in the dampers of suspensions, and below the wheelsets [J]."""
        return np.asarray(total(self._tally.frame_damped) + total(self._tally.frame_railed))

    @cached_property
    def held(self) -> Array:
        """(n_case,) energy that ties of faces and swing stops of struts hold at the end [J]."""
        tally = self._tally
        stiffness = self._lot.values(lambda chain: [line.tie for line in chain.lines])
        rows = zip(tally.line_tied.tolist(), stiffness.tolist(), strict=True)
        ties = [sum(0.5 * tied**2 / k for tied, k in zip(*row, strict=True) if tied) for row in rows]
        turned = np.stack([tally.line_turn_left, tally.line_turn_right], axis=-1)
        swings = self._lot.values(lambda chain: [[line.left.swing, line.right.swing] for line in chain.lines])
        return np.asarray(np.array(ties) + 0.5 * total((swings * turned**2).reshape(len(turned), -1)))

    @cached_property
    def lost(self) -> Array:
        """(n_case,) energy lost in ties that slipped and in swing stops of struts that sheared [J]."""
        return np.asarray(total(self._tally.line_tie_lost) + total(self._tally.line_swing_lost))


def _kinetic(vehicle: Vehicle, q: Array, rate: Array) -> float:
    if vehicle.gear is None:
        return float(0.5 * (vehicle.mass * rate[0] ** 2))
    return float(0.5 * (rate @ vehicle.gear.mass_matrix(q) @ rate))


def _momentum(vehicle: Vehicle, q: Array, rate: Array) -> float:
    return float(vehicle.mass * rate[0] if vehicle.gear is None else vehicle.gear.mass_matrix(q)[X] @ rate)


def _raised(vehicle: Vehicle, q: Array, _: Array) -> float:
    gear = vehicle.gear
    return 0.0 if gear is None else held(gear, q) - held(gear, gear.standing.q)


def held(gear: Gear, q: Array) -> float:
    """Energy that weight, suspensions, stops and rails hold where the degrees of freedom of a vehicle are q, (11,) [J].

    Dampers apart, which hold none. Heights count from the rail, and springs from where they have no force.
    """
    stands, placed = gear.standing, gear.placed(q)
    found = gear.gravity * float(placed.mass @ placed.z)
    for dof, preload in zip(SUSPENDED, stands.preload, strict=True):
        suspension = gear.suspension(dof)
        pressed = q[dof] - stands.q[dof] + preload / suspension.stiffness
        found += 0.5 * suspension.stiffness * pressed**2
        beyond = max(0.0, q[dof] - suspension.bump_stop, -suspension.lift_stop - q[dof])
        found += 0.5 * suspension.stop * beyond**2 if beyond else 0.0
    for wheel, load in zip(WHEELS, stands.load, strict=True):
        rise = placed.z[wheel] - gear.axle_height - gear.offset
        found += 0.5 * gear.rail_stiffness * max(0.0, load / gear.rail_stiffness - rise) ** 2
    return float(found)
