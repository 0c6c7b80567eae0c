"""What a collision leaves behind: histories at the recorded times, and a tally kept at every step.

A saved result is a NetCDF 3 file, which :mod:`trainmj.collision.saved` reads. NetCDF 4 would be HDF5, whose library
loops for ever on some damaged files and takes others for good ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from trainmj.collision.block import TALLY, Tallied, Tally
from trainmj.collision.body import yielded
from trainmj.collision.chain import Chain, order_of_vehicles, places_of_sides
from trainmj.collision.envelope import Array
from trainmj.collision.gear import PITCH
from trainmj.collision.model_plane import names_of_dofs
from trainmj.collision.quantities import names_of_parts
from trainmj.collision.status import not_valid
from trainmj.files.netcdf import Variable, packed
from trainmj.files.shown import Drawn
from trainmj.files.signed import CHECKSUM, UNSIGNED, signed
from trainmj.files.written import write_bytes
from trainmj.scenario import Scenario, to_yaml
from trainmj.units import KJ, KM_H, KN, MM, MRAD, G, head

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

FORMAT = "trainmj result 6"
"""What a saved result calls itself."""

VERSION = "version_"
"""Begins the attributes of a saved result that say what computed it."""


class History(NamedTuple):
    """A quantity that is recorded over time."""

    over: str  # what it has a value for at each time: vehicle, interface, point, member or body
    unit: str  # of the recorded values
    meaning: str  # in words
    shown: str = ""  # unit in a spreadsheet; empty for a quantity that has no column there
    factor: float = 1.0  # by which values are divided to be in that unit


HISTORIES = {
    "position": History("vehicle", "m", "position, 0 where the two sides touch", "mm", MM),
    "velocity": History("vehicle", "m/s", "speed along +x", "km/h", KM_H),
    "acceleration": History("vehicle", "m/s2", "acceleration by all forces", "g", G),
    "stroke": History("interface", "m", "stroke of both sides together", "mm", MM),
    "stroke_rate": History("interface", "m/s", "rate of the stroke"),
    "force": History("interface", "N", "force", "kN", KN),
    "energy": History("interface", "J", "energy absorbed by both sides, elastic energy not counted", "kJ", KJ),
    "left_stroke": History("interface", "m", "stroke of the device of the left side, or of the only one"),
    "right_stroke": History("interface", "m", "stroke of the device of the right side, if it has its own"),
    "left_energy": History("interface", "J", "energy absorbed by the device of the left side, or by the only one"),
    "right_energy": History("interface", "J", "energy absorbed by the device of the right side, if it has its own"),
    "point_position": History("point", "m", "position of a point of a body, 0 where the two sides touch"),
    "point_velocity": History("point", "m/s", "speed of a point of a body along +x"),
    "point_acceleration": History("point", "m/s2", "acceleration of a point of a body by all forces"),
    "member_plastic": History("member", "m", "plastic shortening of a member of a body"),
    "step": History("ends", "m", "rise of the end of a vehicle less that of the next one along +x", "mm", MM),
    "wheel_load": History("wheelset", "N", "load of a wheelset on the rail"),
    "wheel_rise": History("wheelset", "m", "rise of a wheelset from where it stands at rest"),
    "dof": History("degree", "m", "degrees of freedom of all vehicles in the vertical plane [m, rad]"),
}
"""What a result has over time, (n_sample, n_vehicle), (n_sample, n_interface) and so on, by name.

Without bodies that give, the points are the vehicles, and a file has neither points nor members. What is behind the
members is there in the vertical plane only.
"""

SHOWN = {name: h for name, h in HISTORIES.items() if h.shown} | {
    "body_shortening": History("body", "m", "shortening of a body", "mm", MM),
    "body_plastic": History("body", "m", "plastic shortening of a body", "mm", MM),
    "pitch": History(
        "frame", "rad", "pitch of a vehicle, positive with the end that faces the impact up", "mrad", MRAD
    ),
    "lift": History("wheelset", "m", "lift of a wheelset off the rail", "mm", MM),
    "load": History("wheelset", "1", "load of a wheelset on the rail over that at rest"),
}
"""What tables and figures show of it, each vehicle's body as a whole; see :meth:`Result.shown`."""


@dataclass(frozen=True, eq=False)
class Result(Drawn):
    """One collision, computed.

    Attributes:
        scenario: what was collided.
        chain: the same as vehicles and interfaces in SI.
        tally: peaks, energies and impulses from every step.
        time: (n_sample,) recorded times [s].
        position: (n_sample, n_vehicle) of the centres of mass [m], 0 where the two sides touch.
        velocity: (n_sample, n_vehicle) [m/s].
        acceleration: (n_sample, n_vehicle) of all forces [m/s2].
        stroke: (n_sample, n_interface) of both sides together [m].
        stroke_rate: (n_sample, n_interface) [m/s].
        force: (n_sample, n_interface) [N].
        energy: (n_sample, n_interface) absorbed by both sides of it, elastic energy not counted [J].
        left_stroke: (n_sample, n_interface) of the device of the left side, or of the only one [m].
        right_stroke: (n_sample, n_interface) of the device of the right side, if it has its own [m].
        left_energy: (n_sample, n_interface) absorbed by the device of the left side, or by the only one [J].
        right_energy: (n_sample, n_interface) absorbed by the device of the right side, if it has its own [J].
        point_position: (n_sample, n_point) [m]; a vehicle without a body that gives is one point.
        point_velocity: (n_sample, n_point) [m/s].
        point_acceleration: (n_sample, n_point) of all forces [m/s2].
        member_plastic: (n_sample, n_member) plastic shortening of the members of bodies [m].
        step: (n_sample, n_interface) rise of the end on the left of an interface less that of the one on its right, in
            the vertical plane [m]; (n_sample, 0) where vehicles only move along the track.
        wheel_load: (n_sample, n_wheelset) load of the wheelsets on the rail, likewise, left to right [N].
        wheel_rise: (n_sample, n_wheelset) rise of the wheelsets from where they stand at rest [m].
        dof: (n_sample, n_dof) degrees of freedom of all vehicles [m, rad]; see :mod:`trainmj.collision.gear`.
        versions: of trainmj, MuJoCo and the rest that computed it, and the platform.
    """

    scenario: Scenario
    chain: Chain
    tally: Tally
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    stroke: Array
    stroke_rate: Array
    force: Array
    energy: Array
    left_stroke: Array
    right_stroke: Array
    left_energy: Array
    right_energy: Array
    point_position: Array
    point_velocity: Array
    point_acceleration: Array
    member_plastic: Array
    step: Array
    wheel_load: Array
    wheel_rise: Array
    dof: Array
    versions: dict[str, str]

    def __repr__(self) -> str:
        """Title and how it ended: a result holds every number."""
        from trainmj.collision.summary import summarise  # which builds on results

        summary = summarise(self)
        return f"<Result {self.scenario.heading}: {summary.status}, {summary.duration_s:.3f} s>"

    @property
    def step_ms(self) -> float:
        """Step that it was computed with [ms]."""
        return self.scenario.simulation.step_ms

    @property
    def not_valid(self) -> str:
        """What marks its numbers where a curve ended behind which nothing is stated: "not valid after 0.213 s"."""
        return not_valid(self.tally.valid_until)

    @property
    def kinetic(self) -> Array:
        """(n_sample,) kinetic energy of all vehicles [J]; in the vertical plane that of motion along the track."""
        return np.asarray(0.5 * (self.point_velocity**2 @ self.chain.point_mass))

    @property
    def body_shortening(self) -> Array:
        """(n_sample, n_vehicle) shortening of the body of each vehicle [m]; 0 where it does not give."""
        left, right = ([self.chain.edge(i, end) for i in range(len(self.chain.vehicles))] for end in (0, 1))
        return np.asarray(self._moved[:, left] - self._moved[:, right])

    @property
    def body_plastic(self) -> Array:
        """(n_sample, n_vehicle) plastic shortening of the body of each vehicle [m]; 0 where it does not give."""
        plastic = np.zeros_like(self.position)
        for k, member in enumerate(self.chain.members):
            plastic[:, member.vehicle] += self.member_plastic[:, k] if member.span else 0.0
        return plastic

    @property
    def member_shortening(self) -> Array:
        """(n_sample, n_member) shortening of the members of bodies [m]; of a bogie, how far it is behind its point."""
        left, right = ([getattr(member, side) for member in self.chain.members] for side in ("left", "right"))
        return np.asarray(self._moved[:, left] - self._moved[:, right])

    @property
    def member_elastic(self) -> Array:
        """(n_sample, n_member) energy that the springs of the members of bodies hold [J]."""
        stiffness = np.array([member.stiffness for member in self.chain.members])
        return np.asarray(0.5 * stiffness * (self.member_shortening - self.member_plastic) ** 2)

    @property
    def member_yielded(self) -> Array:
        """(n_sample, n_member) energy that the members of bodies have lost by yielding [J], from the records."""
        travel = np.cumsum(np.abs(np.diff(self.member_plastic, axis=0, prepend=0.0)), axis=0)
        return yielded(self.chain.members, travel)

    @property
    def pitch(self) -> Array:
        """(n_sample, n_vehicle) pitch in the vertical plane [rad], positive with the end that faces the impact up."""
        chain = self.chain
        pitch = np.zeros_like(self.position)
        for i, vehicle in enumerate(chain.vehicles):
            if chain.plane and vehicle.gear is not None:
                pitch[:, i] = (1.0 if chain.facing(i) else -1.0) * self.dof[:, chain.first_dof[i] + PITCH]
        return pitch

    @property
    def lift(self) -> Array:
        """(n_sample, n_wheelset) lift of the wheelsets off the rail in the vertical plane [m]; 0 on it."""
        chain = self.chain
        gears = [chain.vehicles[i].gear for i, _ in chain.wheelsets]
        pressed = [chain.load(k) / gear.rail_stiffness for k, gear in enumerate(gears) if gear is not None]
        return np.asarray(np.maximum(0.0, self.wheel_rise - np.array(pressed)))

    @property
    def load(self) -> Array:
        """(n_sample, n_wheelset) load of the wheelsets on the rail over that at rest."""
        return np.asarray(self.wheel_load / [self.chain.load(k) for k in range(len(self.chain.wheelsets))])

    @property
    def _moved(self) -> Array:
        """(n_sample, n_point) how far points have moved [m]."""
        return self.point_position - self.chain.start

    def numbers(self) -> dict[str, Array]:
        """Every number of the result by name, histories and tally."""
        histories = {name: getattr(self, name) for name in ("time", *_histories(self.chain))}
        tally = {f"tally_{t.name}": getattr(self.tally, t.name) for t in _tallied(self.chain)}
        return histories | {name: np.asarray(value, dtype=np.float64) for name, value in tally.items()}

    def dataset(self) -> xr.Dataset:
        """Everything as an xarray Dataset with named dimensions and units."""
        import xarray as xr

        return xr.Dataset(self._numbers(), coords=self._coordinates(), attrs=self._attributes())

    def _numbers(self) -> dict[str, Variable]:
        """Histories and tally with their dimensions and attributes."""
        histories: dict[str, Variable] = {
            name: (("time", h.over), getattr(self, name), {"units": h.unit, "long_name": h.meaning})
            for name, h in _histories(self.chain).items()
        }
        return histories | {
            f"tally_{t.name}": (t.over, getattr(self.tally, t.name), {"units": t.unit, "long_name": t.meaning})
            for t in _tallied(self.chain)
        }

    def _coordinates(self) -> dict[str, Variable]:
        """Time, and the names of what else there are values for."""
        plane = {
            "wheelset": [self.chain.name_of_wheelset(i, k) for i, k in self.chain.wheelsets],
            "degree": [name for i in range(len(self.chain.vehicles)) for name in names_of_dofs(self.chain, i)],
        }
        bodies = {
            "point": [point.name for point in self.chain.points],
            "member": [member.name for member in self.chain.members],
        }
        names = {
            "vehicle": [v.name for v in self.chain.vehicles],
            "interface": [i.name for i in self.chain.interfaces],
            **(bodies if self.chain.members else {}),
            **(plane if self.chain.plane else {}),
        }
        return {"time": ("time", self.time, {"units": "s"}), **{name: (name, of, {}) for name, of in names.items()}}

    def _attributes(self) -> dict[str, str | float]:
        return {
            "title": self.scenario.heading,
            "scenario": to_yaml(self.scenario),
            "format": FORMAT,
            "step_ms": self.step_ms,
            "refined": int(self.chain.refined),
            **({"valid_until_s": self.tally.valid_until} if self.not_valid else {}),
            **{f"{VERSION}{name}": version for name, version in self.versions.items()},
        }

    def save(self, file: str | Path) -> None:
        """Write everything to a NetCDF 3 file, which xarray, MATLAB and ncdump read.

        Raises:
            OutputError: if the file cannot be written.
        """
        attributes = self._attributes() | {CHECKSUM: UNSIGNED}
        write_bytes(file, signed(packed(self._numbers() | self._coordinates(), attributes)))

    def table(self, both_sides: bool = False) -> pd.DataFrame:
        """Histories in engineering units, one row per recorded time, for a spreadsheet.

        Column valid is 0 in rows after a curve ended behind which nothing is stated, or one vehicle overrode another,
        and 1 in all others.

        Args:
            both_sides: whether the partner's stroke and energy at the front are there too where the sides are equal.
        """
        import pandas as pd

        return pd.DataFrame(self.columns(both_sides))

    def columns(self, both_sides: bool = False) -> dict[str, Array]:
        """The columns of :meth:`table` by their heads."""
        columns: dict[str, Array] = {"time_s": self.time, "valid": (self.time <= self.tally.valid_until).astype(int)}
        for name, h in SHOWN.items():
            for thing, values in self.shown(name).items():
                columns[head(f"{name}_{thing.replace(' ', '_')}", h.shown)] = values
            front = self.chain.interfaces[self.chain.front]
            if both_sides and front.equal_sides and name in ("stroke", "energy"):
                values = self.of_device(name, self.chain.front, 1) / h.factor
                columns[head(f"{name}_{front.name}_partner", h.shown)] = values
        return columns

    def shown(self, name: str) -> dict[str, Array]:
        """A history as tables and figures show it: (n_sample,) values in its shown unit, by vehicle or interface.

        They come in the order of the tables, of bodies those that give. At the front, stroke and energy are those of
        one train's side: where the sides are not equal, the partner's are there too. What is of the vertical plane is
        there in it only: steps by interface, pitch by vehicle, lifts and loads by wheelset.
        """
        history, chain = SHOWN[name], self.chain
        if history.over in OF_PLANE and not chain.plane:
            return {}
        values: Array = getattr(self, name) / history.factor
        if history.over == "wheelset":
            names = (found for i in order_of_vehicles(chain) for found in names_of_parts(chain, "wheelsets", i))
            return {name: values[:, k] for k, name in names}
        if history.over == "ends":
            order = dict.fromkeys(k for k, _ in places_of_sides(chain))
            return {chain.interfaces[k].name: values[:, k] for k in order}
        if history.over == "frame":
            upright = (i for i in order_of_vehicles(chain) if chain.vehicles[i].gear is not None)
            return {chain.vehicles[i].name: values[:, i] for i in upright}
        if history.over in ("vehicle", "body"):
            shown = (i for i in order_of_vehicles(chain) if history.over == "vehicle" or chain.vehicles[i].body)
            return {chain.vehicles[i].name: values[:, i] for i in shown}
        found = {}
        for k, side in places_of_sides(chain):
            interface, column = chain.interfaces[k], values[:, k]
            if name in ("stroke", "energy"):
                column = self.of_device(name, k, side) / history.factor
            found[interface.sides[side]] = column
        return found

    def of_device(self, name: str, k: int, side: int) -> Array:
        """(n_sample,) stroke [m] or absorbed energy [J] of the device on a side (0 left, 1 right) of interface k."""
        values: Array = getattr(self, f"{'right' if side else 'left'}_{name}")
        return values[:, k]


def _histories(chain: Chain) -> dict[str, History]:
    """What a file of a chain has over time."""
    return {name: h for name, h in HISTORIES.items() if h.over not in _absent(chain)}


def _tallied(chain: Chain) -> list[Tallied]:
    """What a file of a chain has of the tally."""
    return [t for t in TALLY if not _absent(chain) & set(t.over)]


def _absent(chain: Chain) -> set[str]:
    """What a file of a chain has no dimension for: points and members where no body gives, what is of the plane."""
    return set(() if chain.members else _OF_BODIES) | set(() if chain.plane else OF_PLANE)


def dimensions_of(chain: Chain) -> dict[str, tuple[str, ...]]:
    """The dimensions of every variable in a file of a chain."""
    return {
        "time": ("time",),
        **{name: ("time", history.over) for name, history in _histories(chain).items()},
        **{f"tally_{t.name}": t.over for t in _tallied(chain)},
    }


_OF_BODIES = ("point", "member")
OF_PLANE = ("frame", "wheelset", "ends", "line", "degree")
"""What only results in the vertical plane have values for."""
