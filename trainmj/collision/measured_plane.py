"""What a collision in the vertical plane left behind beside strokes and forces: positions, energies, momenta.

The energies are those of the vehicles as they stand, by the kinematics of :mod:`trainmj.collision.gear`; they owe
nothing to MuJoCo's own sums.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trainmj.collision.block import Tally
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.gear import N_DOF, SUSPENDED, WHEELS, Gear, X


@dataclass(frozen=True, eq=False)
class InPlane:
    """The vertical plane of a collision."""

    chain: Chain
    tally: Tally

    @cached_property
    def q(self) -> Array:
        """(n_vehicle, 11) degrees of freedom at the end [m, rad]; 0 where a vehicle has none."""
        return np.column_stack([getattr(self.tally, f"frame_q{k}") for k in range(N_DOF)])

    @cached_property
    def v(self) -> Array:
        """(n_vehicle, 11) their rates."""
        return np.column_stack([getattr(self.tally, f"frame_v{k}") for k in range(N_DOF)])

    @property
    def pitch(self) -> Array:
        """(n_vehicle,) pitch of largest magnitude [rad], positive with the end that faces the impact up."""
        high, low = self.tally.frame_pitch_max, self.tally.frame_pitch_min
        facing = np.array([1.0 if self.chain.facing(i) else -1.0 for i in range(len(self.chain.vehicles))])
        return np.asarray(facing * np.where(high >= -low, high, low))

    @property
    def heave(self) -> Array:
        """(n_vehicle,) rise of the centre of gravity of the body of largest magnitude [m]."""
        high, low = self.tally.frame_heave_max, self.tally.frame_heave_min
        return np.asarray(np.where(high >= -low, high, low))

    @property
    def lift(self) -> Array:
        """(n_wheelset,) largest lift off the rail [m]."""
        return np.asarray(self.tally.wheel_lift_max)

    @property
    def lift_time(self) -> Array:
        """(n_wheelset,) when it was [s]; nan if it stayed on the rail."""
        return np.asarray(np.where(self.tally.wheel_lift_time < 0.0, np.nan, self.tally.wheel_lift_time))

    @cached_property
    def rest(self) -> Array:
        """(n_wheelset,) load at rest [N]."""
        return np.array([self.chain.load(k) for k in range(len(self.chain.wheelsets))])

    @property
    def load(self) -> Array:
        """(n_wheelset,) least load over that at rest."""
        return np.asarray(self.tally.wheel_load_min / self.rest)

    def of_vehicles(self, values: Array, worst: Callable[[Array], float], without: float) -> Array:
        """(n_vehicle,) worst of the values of the wheelsets of each vehicle, or what stands for one without."""
        owner = np.array([i for i, _ in self.chain.wheelsets], dtype=int)
        each = (values[owner == i] for i in range(len(self.chain.vehicles)))
        return np.array([worst(own) if own.size else without for own in each])

    @property
    def _own(self) -> Array:
        return np.array([i < self.chain.n_moving for i, _ in self.chain.wheelsets], dtype=bool)

    @property
    def own_lift(self) -> float:
        """Largest lift of a wheelset of the moving train [m]."""
        return float(self.lift[self._own].max())

    @property
    def own_load(self) -> float:
        """Least load of a wheelset of the moving train over that at rest."""
        return float(self.load[self._own].min())

    @property
    def own_step(self) -> float:
        """Largest step of an interface of the moving train, that at the front included [m]."""
        return float(self.tally.ends_step_max[: self.chain.front + 1].max())

    @cached_property
    def kinetic(self) -> float:
        """Kinetic energy at the end [J]."""
        return float(
            sum(
                0.5 * (v.mass * rate[0] ** 2 if v.gear is None else rate @ v.gear.mass_matrix(q) @ rate)
                for v, q, rate in zip(self.chain.vehicles, self.q, self.v, strict=True)
            )
        )

    @cached_property
    def momentum(self) -> float:
        """Momentum along the track at the end [N s]."""
        return float(
            sum(
                v.mass * rate[0] if v.gear is None else v.gear.mass_matrix(q)[X] @ rate
                for v, q, rate in zip(self.chain.vehicles, self.q, self.v, strict=True)
            )
        )

    @cached_property
    def raised(self) -> float:
        """Energy that weight, suspensions and rails hold at the end, more than at the start [J]."""
        gears = [(i, v.gear) for i, v in enumerate(self.chain.vehicles) if v.gear is not None]
        return float(sum(held(gear, self.q[i]) - held(gear, gear.standing.q) for i, gear in gears))

    @cached_property
    def damped(self) -> float:
        """Energy lost in the dampers of suspensions, and below the wheelsets [J]."""
        return float(self.tally.frame_damped.sum() + self.tally.frame_railed.sum())

    @cached_property
    def held(self) -> float:
        """Energy that ties of faces and swing stops of struts hold at the end [J]."""
        tally, lines = self.tally, self.chain.lines
        ties = sum(0.5 * tied**2 / line.tie for tied, line in zip(tally.line_tied, lines, strict=True) if tied)
        turned = np.column_stack([tally.line_turn_left, tally.line_turn_right])
        stiffness = np.array([[line.left.swing, line.right.swing] for line in lines])
        return float(ties + 0.5 * np.sum(stiffness * turned**2))

    @cached_property
    def lost(self) -> float:
        """Energy lost in ties that slipped and in swing stops of struts that sheared [J]."""
        return float(self.tally.line_tie_lost.sum() + self.tally.line_swing_lost.sum())


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
