"""What a collision has done to its devices so far: each is shown shorter, and coloured by the energy absorbed."""

from __future__ import annotations

import numpy as np

from trainmj.collision.chain import WALL, Chain
from trainmj.collision.envelope import Array
from trainmj.collision.mj import mujoco
from trainmj.collision.result import Result
from trainmj.units import MM
from trainmj.view.parts import device_of, ends, is_shared

_RAMP = {  # colours by share: from steel to dark red, darker for more, to every eye; after ColorBrewer's YlOrRd
    0.0: (0.74, 0.76, 0.78),
    0.04: (0.996, 0.85, 0.46),
    0.25: (0.992, 0.70, 0.30),
    0.5: (0.99, 0.45, 0.18),
    0.75: (0.84, 0.12, 0.12),
    1.0: (0.50, 0, 0.15),
}


def colour(share: float | Array) -> Array:
    """(..., 3) red, green and blue for a share of the largest energy."""
    return np.stack([np.interp(share, list(_RAMP), channel) for channel in zip(*_RAMP.values(), strict=True)], axis=-1)


class Wear:
    """Devices of a chain as they are used up; update it with every sample, in order.

    Attributes:
        largest: (n_interface,) largest strokes so far [m].
        crushed: (n_interface,) strokes as they are now, the permanent set at least [m].
        energy: by interface and side, (n_stage,) absorbed by each stage of the device that is drawn there [J].
    """

    def __init__(self, chain: Chain) -> None:
        """Untouched devices."""
        n = len(chain.interfaces)
        self._chain = chain
        self.largest = np.zeros(n)
        self.crushed = np.zeros(n)
        self.energy = {
            (k, side): np.zeros(len(device_of(interface, side).stages))
            for k, interface in enumerate(chain.interfaces)
            for side in range(1 if interface.right == WALL else 2)
        }

    def update(self, stroke: Array, energy: Array) -> None:
        """Follow a sample: (n_interface,) strokes [m] and absorbed energies [J]."""
        np.maximum(self.largest, stroke, out=self.largest)
        for k, interface in enumerate(self._chain.interfaces):
            envelope, most = interface.envelope, float(self.largest[k])
            set_ = most - envelope.force_at(most) / envelope.stiffness if most > 0 else 0.0
            self.crushed[k] = max(0.0, set_, stroke[k])
            shares = interface.energy_shares(self.largest[k : k + 1])
            for side in [s for j, s in self.energy if j == k]:
                own = 0 if is_shared(interface) else side  # both ends draw a shared device, and all of its energy
                used = interface.side_largest(most, own)
                reached = sum(used >= stage.start for stage in device_of(interface, side).stages[1:])
                stages = self.energy[k, side]
                stages[reached] += max(0.0, float(shares[own][0] * energy[k]) - stages.sum())

    def side_stroke(self, k: int, side: int) -> float:
        """What one side of an interface shows of its stroke now [m]: its own device's, or half of a shared one's."""
        interface, now = self._chain.interfaces[k], self.crushed[k]
        if is_shared(interface):
            return float(now / 2)
        return float(interface.side_history(np.array([self.largest[k], now]), side)[-1])

    @property
    def TS_mm(self) -> float:
        """Total compression along the moving train so far, as the summary counts it at the end."""
        return sum(
            stage.stroke(self._chain.interfaces[k].side_largest(float(self.largest[k]), 0)) / MM
            for k in range(self._chain.n_moving)
            for stage in self._chain.interfaces[k].devices[0].stages
        )


def largest_energy(result: Result) -> float:
    """The largest energy that any device of a collision absorbs [J], at which the colours end."""
    wear = Wear(result.chain)
    wear.update(result.stroke.max(axis=0), result.energy.max(axis=0))
    return max(float(energy.sum()) for energy in wear.energy.values())


class DeviceShapes:
    """The shapes of devices in a compiled model, which follow their wear."""

    def __init__(self, model: mujoco.MjModel, chain: Chain, full: float) -> None:
        """Find them by name; full is the energy at the end of the colours [J]."""
        self._model, self._full = model, max(full, 1.0)
        self._ends = [(end, [(part, model.geom(part.name).id) for part in end.parts]) for end in ends(chain)]

    def show(self, wear: Wear) -> None:
        """Shorten and colour every part."""
        model = self._model
        for end, parts in self._ends:
            stroke = wear.side_stroke(end.interface, end.side)
            colours = colour(wear.energy[end.interface, end.side] / self._full)
            for part, geom in parts:
                begin, finish = part.placed(stroke)
                model.geom_pos[geom, 0] = end.direction * 0.5 * (begin + finish)
                along = 1 if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER else 0
                model.geom_size[geom, along] = 0.5 * (finish - begin)
                if part.shape.material == "device":
                    model.geom_matid[geom] = -1
                    model.geom_rgba[geom, :3] = colours[part.zone.stage]
