"""What a collision has done to devices and bodies so far, as pictures show it: how far pressed, what they absorbed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from trainmj.collision.block import alone
from trainmj.collision.body import yielded
from trainmj.collision.chain import WALL, Chain, Element, Interface, n_own_sides, places_of_sides
from trainmj.collision.device import Device, Path
from trainmj.collision.element import advance
from trainmj.collision.envelope import Array
from trainmj.collision.fields import ELEMENT
from trainmj.collision.line import Line, LineEnd
from trainmj.collision.result import Result
from trainmj.units import MM

SEEN = (
    *("stroke", "force", "left_stroke", "right_stroke", "left_energy", "right_energy"),
    *("point_position", "member_plastic", "dof"),
)
GIVEN = 1e-3
"""Plastic shortening of a member from which on pictures colour it [m]."""

_CLOSE = 1e-9  # [m]


class Worn:
    """A device on one side of an interface as it is used up.

    Attributes:
        energy: (n_stage,) absorbed by each stage [J].
    """

    def __init__(self, device: Device, paths: Sequence[Path]) -> None:
        """Untouched; the paths are the ways through it that act."""
        self._paths = [_Pressed(path) for path in paths]
        self.energy = np.zeros(len(device.stages))
        self._absorbed = self._stroke = 0.0

    def update(self, stroke: float, energy: float) -> None:
        """Follow a sample: stroke [m] and absorbed energy [J]; the stage that has been reached takes what is new."""
        self._stroke = stroke
        depth, engaged = max(0.0, stroke), self._paths[0]
        for one in self._paths[1:]:
            if one.path.start <= depth:
                engaged = one
        engaged.most = max(engaged.most, stroke)
        if energy > self._absorbed:
            reached = sum(used > 0.0 for used in self.used[1:]) if self.energy.size > 1 else 0
            self.energy[reached] += energy - self._absorbed
            self._absorbed = energy

    def along(self, strokes: Array) -> Array:
        """(n_sample,) what it would show at each of its strokes [m], followed from new in this order."""
        shown = np.maximum(0.0, strokes)
        engaged = np.searchsorted([one.path.start for one in self._paths[1:]], shown, side="right")
        for n, one in enumerate(self._paths):
            most = np.maximum.accumulate(np.where(engaged == n, strokes, 0.0))
            back = np.flatnonzero(most > shown)  # elsewhere nothing more can have been kept
            pressed, which = np.unique(most[back], return_inverse=True)
            kept = np.array([one.path.start + _kept(one.path, far) for far in pressed.tolist()])
            if back.size:
                shown[back] = np.maximum(shown[back], kept[which])
        return shown

    @property
    def used(self) -> list[float]:
        """(n_stage,) largest strokes of the stages themselves so far [m]."""
        return [stage.stroke(one.most) for one in self._paths for stage in one.path.stages]

    def past(self, n: int) -> bool:
        """Whether a path of the device has been pressed to its end."""
        return max(one.most for one in self._paths) >= self._paths[min(n, len(self._paths) - 1)].path.stages[-1].end

    @property
    def shown(self) -> float:
        """Its stroke, the permanent set at least [m]."""
        stroke = max(0.0, self._stroke)  # below which a path has kept more only if it was pressed further
        return max([stroke, *[one.permanent for one in self._paths if one.most > stroke]])


class _Pressed:
    """A path through a device, pressed at rest as far as the device has come: what remains of it.

    A device that was faster has kept at most what its spring gives more; that is too little to be seen.
    """

    def __init__(self, path: Path) -> None:
        """Not pressed yet."""
        self.path = path
        self.most = self._seen = 0.0  # largest stroke of the device on this path [m]
        self._permanent = 0.0

    @property
    def permanent(self) -> float:
        """Stroke of the device that remains without force [m]."""
        if self.most != self._seen:
            self._seen, self._permanent = self.most, self.path.start + _kept(self.path, self.most)
        return self._permanent


def _kept(path: Path, most: float) -> float:
    """Stroke of a path that remains without force, pressed at rest up to a stroke of the device [m]."""
    block = alone(Element((path.law,))).tolist()
    advance(block, 0, most - path.start, 0.0, 0.0, 0.0)
    return float(path.law.kind.permanent(path.law, block[ELEMENT.STATE_0], block[ELEMENT.STATE_1]))


class _Strut:
    """A strut between the pins of two vehicles in the vertical plane."""

    def __init__(self, chain: Chain, interface: Interface, line: Line) -> None:
        """Along the vehicles, which have not met."""
        self.line = line
        self.turned = (0.0, 0.0)
        self._chain, self._places = chain, (interface.left, interface.right)
        self._met = line.inner

    def follow(self, dof: Array, stroke: float) -> None:
        """Turn with the pins of both vehicles, once they have met."""
        self._met |= stroke > _CLOSE
        if not self._met:
            return
        left, right = self.line.left, self.line.right
        x, z, pitch = self._pin(dof, 0, left)
        other_x, other_z, other_pitch = self._pin(dof, 1, right)
        angle = math.atan2(other_z - z, left.pin + right.pin + other_x - x)
        self.turned = angle - pitch, angle - other_pitch

    def _pin(self, dof: Array, side: int, end: LineEnd) -> tuple[float, float, float]:
        """How far a pin has come along the track, its height, and the pitch of its vehicle."""
        chain, vehicle = self._chain, self._places[side]
        if vehicle == WALL:
            return 0.0, end.height, 0.0
        first, gear = chain.first_dof[vehicle], chain.vehicles[vehicle].gear
        if gear is None:
            return float(dof[first]), end.height, 0.0
        x, z, pitch = dof[first : first + 3].tolist()
        ahead, above = chain.point_of_line(vehicle, 1 - side, end)
        sine, cosine = math.sin(pitch), math.cos(pitch)
        height = gear.cog_height + gear.offset + z + ahead * sine + above * cosine
        return x + ahead * cosine - above * sine - ahead, height, pitch


class Wear:
    """Devices and bodies of a chain as they are used up; update it with every sample, in order.

    Attributes:
        worn: the device on each side (0 left, 1 right) of each interface; both sides draw one that they share.
        moved: (n_point,) how far points have moved [m].
        plastic: (n_member,) plastic shortening of the members of bodies [m].
        dof: (n_dof,) degrees of freedom in the vertical plane; none where vehicles only move along the track.
    """

    def __init__(self, chain: Chain) -> None:
        """Untouched devices."""
        self._chain = chain
        self.worn: dict[tuple[int, int], Worn] = {}
        for k, interface in enumerate(chain.interfaces):
            for side, device in enumerate(interface.devices):
                self.worn[k, side] = Worn(device, interface.paths(side))
            if interface.is_shared:
                self.worn[k, 1] = self.worn[k, 0]
        self._own = [(k, side) for k, i in enumerate(chain.interfaces) for side in range(len(i.devices))]
        self._coupled = {k: i for k, i in enumerate(chain.interfaces) if any(e.sign < 0 for e in i.elements)}
        self._stroke = self._lowest = np.zeros(len(chain.interfaces))
        self.moved = np.zeros(len(chain.points))
        self.plastic = self._travel = np.zeros(len(chain.members))
        self.dof = chain.start_qpos if chain.plane else np.zeros(0)
        self._struts = {
            (k, n): _Strut(chain, interface, element.line)
            for k, interface in enumerate(chain.interfaces)
            for n, element in enumerate(interface.elements)
            if element.sign > 0 and element.line is not None and element.line.strut
        }

    def update(self, seen: Mapping[str, Array]) -> None:
        """Follow a sample: of SEEN, the histories of a result by name, in SI."""
        strokes = seen["left_stroke"].tolist(), seen["right_stroke"].tolist()
        energies = seen["left_energy"].tolist(), seen["right_energy"].tolist()
        for k, side in self._own:
            self.worn[k, side].update(strokes[side][k], energies[side][k])
        self._stroke = np.array(seen["stroke"])
        for k, interface in list(self._coupled.items()):
            slack = next(element.start for element in interface.elements if element.sign < 0)
            if self._stroke[k] < min(self._lowest[k], -slack) - _CLOSE and seen["force"][k] >= 0.0:
                del self._coupled[k]  # drawn farther apart than ever without force: it has broken
        self._lowest = np.minimum(self._lowest, self._stroke)
        self.moved = np.asarray(seen["point_position"] - self._chain.start)
        self._travel = self._travel + np.abs(seen["member_plastic"] - self.plastic)
        self.plastic = np.array(seen["member_plastic"])
        self.dof = np.asarray(seen["dof"])
        for (k, n), strut in self._struts.items():
            sides = [self.worn[place] for place in ((k, 0), (k, 1)) if place in self.worn]
            if not (strut.line.shears and any(worn.past(n) for worn in sides)):
                strut.follow(self.dof, self._stroke[k])

    def history(self, result: Result) -> dict[tuple[int, int], Array]:
        """(n_sample,) what each device of each interface shows of its stroke at the records of a collision [m].

        By interface and side, as :meth:`shown` says it one record after the other.
        """
        found = {place: np.empty(len(result.time)) for place in self._own}
        if self._coupled:
            for sample in range(len(result.time)):
                self.update(seen_at(result, sample))
                for place, shown in found.items():
                    shown[sample] = self.shown(*place)
            return found
        for k, side in found:
            share = 0.5 if self._chain.interfaces[k].is_shared else 1.0
            found[k, side] = share * self.worn[k, side].along(result.of_device("stroke", k, side))
        return found

    def turned(self, k: int, path: int, side: int) -> float:
        """Angle of a strut of an interface against the vehicle on one side [rad], positive as its pitch.

        A strut lies along its vehicle until both ends have met, and stays as it was once it has sheared off.
        """
        return self._struts[k, path].turned[side]

    def shown(self, k: int, side: int) -> float:
        """What one side of an interface shows of its stroke now [m]: its own device's, or half of a shared one's.

        Couplers that a draw gear holds together stay together, however far the vehicles are apart.
        """
        share = 0.5 if self._chain.interfaces[k].is_shared else 1.0
        own = share * self.worn[k, side].shown
        if k not in self._coupled:
            return own
        return own - 0.5 * max(0.0, own + share * self.worn[k, 1 - side].shown - float(self._stroke[k]))

    def energy(self, k: int) -> float:
        """What an interface has absorbed; at the front one train [J]."""
        sides = range(1 if k == self._chain.front else len(self._chain.interfaces[k].devices))
        return float(sum(self.worn[k, side].energy.sum() for side in sides))

    @property
    def yielded(self) -> Array:
        """(n_member,) energy that the members of bodies have lost by yielding [J]."""
        return yielded(self._chain.members, self._travel)

    @property
    def TS_mm(self) -> float:
        """Total compression along the moving train so far, as the summary counts it at the end."""
        chain = self._chain
        own = places_of_sides(chain)[: n_own_sides(chain)]
        return sum(used / MM for place in own for used in self.worn[place].used)


def seen_at(result: Result, sample: int) -> dict[str, Array]:
    """What :meth:`Wear.update` follows, at a sample of a collision."""
    return {name: getattr(result, name)[sample] for name in SEEN}
