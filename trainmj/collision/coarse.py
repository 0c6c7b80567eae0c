"""Peaks for which the step may be too coarse, as the law's notes of every step tell it, at no cost to speak of.

A peak is sharp where its force is above those of both neighbouring steps by a good part of it: what lies between the
steps may be off by as much. A smooth peak may be late: the force on a vehicle that is pushed to and fro swings, each
swing is met up to a step late, and what that adds up to until the peak is an angle of the vibration. By then the order
in which vehicles meet, and with it the peak, hangs on the step.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trainmj.collision.chain import names_in_runs, order_of_vehicles
from trainmj.collision.elementwise import lesser
from trainmj.collision.envelope import Array, BoolArray
from trainmj.collision.measured import Measured
from trainmj.collision.status import COARSE
from trainmj.units import MS

SHARP = 0.05
"""Least part of a peak by which it stands out of both neighbours and counts as sharp."""

LATE = 0.5
"""Least angle by which the swings before a peak may be late, and it counts as such [rad]."""

_COUNTS = 0.02  # peaks to speak of, relative to the largest of their kind
_ONE_SIDED = 10.0  # a change on one side of a peak that is so many times that on the other is a jump and no swing
_WANTED = 0.01  # of a peak that is sharp


class Coarse:
    """The peaks of a lot for which the step may be too coarse.

    Attributes:
        forces: (n_case, n_interface) by how much sharp peaks of interfaces stand out, relative; 0 of others.
        peaks: (n_case, n_vehicle) likewise of the forces of all devices on a vehicle.
        late: (n_case, n_vehicle) by which angle the swings before a smooth peak of that may be late [rad]; 0 if by
            little.
    """

    @np.errstate(all="ignore")
    def __init__(self, measured: Measured) -> None:
        """Look at the peaks of a lot."""
        tally, self._chain = measured.tally, measured.chain
        force, net = tally.force_max, tally.device_peak * measured.mass
        self.forces = _sharp(force, tally.force_rise, tally.force_fall, _counts(force))
        counts = _counts(tally.device_peak)
        self.peaks = _sharp(net, tally.peak_rise, tally.peak_fall, counts)
        once = lesser(tally.peak_rise, tally.peak_fall) / net
        bend = lesser((tally.peak_rise + tally.peak_fall) / net, _ONE_SIDED * once)  # (frequency times step)^2
        angle = tally.peak_swung / net * np.sqrt(bend)
        self.late = np.where(counts & (self.peaks == 0.0) & (angle > LATE), angle, 0.0)

    @property
    def cases(self) -> BoolArray:
        """(n_case,) whether there is any."""
        return np.asarray((self.forces > 0.0).any(axis=-1) | ((self.peaks > 0.0) | (self.late > 0.0)).any(axis=-1))

    def said(self, case: int) -> str:
        """What the status of a case says of them; empty if there is none."""
        joints = [interface.name for k, interface in enumerate(self._chain.interfaces) if self.forces[case, k] > 0.0]
        vehicles = self._vehicles((self.peaks[case] > 0.0) | (self.late[case] > 0.0))
        names = ", ".join(filter(None, (*joints, vehicles)))
        return f"{COARSE} for the peak forces of {names}" if names else ""

    def remarks(self, case: int) -> Iterator[str]:
        """A sentence for each kind, with sizes and the cure."""
        step, chain = self._chain.step / MS, self._chain
        found = [(interface.name, self.forces[case, k]) for k, interface in enumerate(chain.interfaces)]
        found += [(chain.vehicles[i].name, self.peaks[case, i]) for i in order_of_vehicles(chain)]
        sharp = {name: share for name, share in found if share > 0.0}
        if sharp:
            names = ", ".join(f"{name} ({share:.0%})" for name, share in sharp.items())
            yield (
                f"{names}: the largest force is above those of the steps before and behind it by so much, and may be "
                f"off by as much. With simulation.step_ms = {step * _WANTED / max(sharp.values()):.2g} in place of "
                f"{step:.6g} a corner of a curve comes to {_WANTED:.0%}."
            )
        if late := self._vehicles(self.late[case] > 0.0):
            yield (
                f"{late}: before its peak the force of the devices has swung so often that steps of {step:.6g} ms may "
                f"have moved it by {self.late[case].max():.1f} rad of its vibration; peaks hang on the step then. See "
                "with trainmj run --converge what a smaller one changes."
            )

    def _vehicles(self, which: BoolArray) -> str:
        chain = self._chain
        return names_in_runs([chain.vehicles[i].name for i in order_of_vehicles(chain) if which[i]])


def _counts(peaks: Array) -> BoolArray:
    """(n_case, n) which peaks are to speak of."""
    return np.asarray(peaks >= _COUNTS * peaks.max(axis=-1, keepdims=True, initial=0.0))


def _sharp(peak: Array, rise: Array, fall: Array, counts: BoolArray) -> Array:
    """(n_case, n) by how much sharp peaks stand out of both neighbours, relative; 0 of others."""
    share = lesser(rise, fall) / peak
    return np.where(counts & (share > SHARP), share, 0.0)
