"""What a summary is made of: the numbers of a vehicle, an interface, a stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from trainmj.collision.device import CAR_BODY
from trainmj.errors import close_match
from trainmj.units import beyond

COLLAPSED = 1.0
"""Plastic shortening or lengthening of a car body from which on it counts as collapsed [mm]."""


@dataclass(frozen=True)
class Numbers:
    """Numbers by name; each is an attribute too.

    Attributes:
        values: by name, in the order of their table.
    """

    values: Mapping[str, float]

    def __getattr__(self, name: str) -> float:
        """A number by its name.

        Raises:
            AttributeError: if there is none of that name; the message says which name is near.
        """
        values: Mapping[str, float] = self.__dict__.get("values", {})
        try:
            return values[name]
        except KeyError:
            raise AttributeError(f"there is no {name!r} here{close_match(name, values)}") from None


@dataclass(frozen=True)
class StageUse:
    """How far one stage of a device was used.

    Attributes:
        name: of the stage, such as anti_climber.
        stroke_mm: largest stroke.
        limit_mm: what the design allows; None if it states nothing.
        energy_kJ: that it absorbed.
    """

    name: str
    stroke_mm: float
    limit_mm: float | None
    energy_kJ: float

    @property
    def collapsed(self) -> bool:
        """Whether it is the car body, and has given way."""
        return self.name == CAR_BODY and self.stroke_mm > COLLAPSED

    @property
    def exhausted(self) -> bool:
        """Whether the limit was passed."""
        return self.limit_mm is not None and beyond(self.stroke_mm, self.limit_mm)


@dataclass(frozen=True)
class FaceUse:
    """How two faces of an interface met, in the vertical plane.

    Attributes:
        name: of the stage whose faces they are, such as anti_climber.
        overlap_mm: step at which one slides off the other.
        met_step_mm: their step when they first carried force; None if they never did.
        off_s: when one slid off the other; None if it did not.
    """

    name: str
    overlap_mm: float
    met_step_mm: float | None
    off_s: float | None

    @property
    def used(self) -> float | None:
        """How much of the overlap the offset took when they met [%]; None if they never did."""
        return None if self.met_step_mm is None else 100.0 * self.met_step_mm / self.overlap_mm


@dataclass(frozen=True)
class InterfaceMetrics(Numbers):
    """One interface, or one train's side of the front interface.

    Its numbers are those of :data:`trainmj.collision.quantities.INTERFACE`: ``stroke_mm``, ``energy_kJ`` and so on.

    Attributes:
        name: S1-M1, M1-M2 and so on; the partner's side of an unequal front is "S1-M1 partner".
        device: name of the device.
        stages: how far each stage of the device was used.
        beyond_curve: whether the stroke went past the end of a curve behind which nothing is stated: the force is only
            held there, and is not valid.
        draws: whether it has draw gear.
        drawn_out: whether that was drawn past the end of its own curve.
        judged: whether the limits of its stages count: those of a partner that is no twin do not.
        slid: in the vertical plane, stages whose faces slid off each other, or whose pins met, in words.
        faces: there, the stages that have faces.
    """

    name: str
    device: str
    stages: tuple[StageUse, ...]
    beyond_curve: bool
    draws: bool = False
    drawn_out: bool = False
    judged: bool = True
    slid: tuple[str, ...] = ()
    faces: tuple[FaceUse, ...] = ()

    @property
    def crush_mm(self) -> float:
        """Stroke without empty strokes: what counts in TS."""
        return sum(stage.stroke_mm for stage in self.stages)

    @property
    def exhausted(self) -> bool:
        """Whether a stroke limit was passed, or the end of the curve."""
        return self.beyond_curve or any(stage.exhausted or stage.collapsed for stage in self.stages)

    def as_row(self) -> dict[str, Any]:
        """Plain values for a table; stages are left out."""
        return {"name": self.name, "device": self.device, **self.values, "beyond_curve": self.beyond_curve}

    def as_dict(self) -> dict[str, Any]:
        """Plain values, stages too."""
        stages = [vars(stage) for stage in self.stages]
        plane: dict[str, Any] = {"slid": self.slid} if self.slid else {}
        plane |= {"faces": [vars(face) for face in self.faces]} if self.faces else {}
        return self.as_row() | {"stages": stages, "crush_mm": self.crush_mm, "exhausted": self.exhausted} | plane


@dataclass(frozen=True)
class PartMetrics(Numbers):
    """One member or one point of a body that gives, or one wheelset.

    Its numbers are those of :data:`trainmj.collision.quantities.MEMBER`, ``POINT`` or ``WHEELSET``.

    Attributes:
        name: "M1 member 1", "M1 2", "M1 bogie 1", "M1 wheelset 1".
    """

    name: str

    def as_row(self) -> dict[str, Any]:
        """Plain values for a table."""
        return {"name": self.name, **self.values}


@dataclass(frozen=True)
class ContactWindow:
    """A time in which the devices push a vehicle away from the impact.

    Attributes:
        start_s: when their net force exceeded simulation.contact_threshold_kN.
        end_s: when it fell to it again, or the end of the run.
        mean_g: mean acceleration in between by the devices alone.
        cut: whether the run ended before the window.
    """

    start_s: float
    end_s: float
    mean_g: float
    cut: bool


@dataclass(frozen=True)
class VehicleMetrics(Numbers):
    """One vehicle.

    Its numbers are those of :data:`trainmj.collision.quantities.VEHICLE`: ``peak_device_acceleration_g`` and so on.

    Attributes:
        name: M1, S1 and so on.
        kind: what its train calls it.
        members: of its body, if it gives, from the end that faces the impact; then the links of its bogies.
        points: likewise, the points between them; then its bogies.
        wheelsets: in the vertical plane, from the end that faces the impact.
        used_up: whether a member was shortened by its whole length, behind which nothing is stated.
        judged: whether it counts if its body gives way: that of a partner that is no twin does not.
        contacts: its contact windows; of more than KEPT that have ended, all but the last are the first ones, and the
            last is the worst of the others.
    """

    name: str
    kind: str
    members: tuple[PartMetrics, ...] = ()
    points: tuple[PartMetrics, ...] = ()
    wheelsets: tuple[PartMetrics, ...] = ()
    used_up: bool = False
    judged: bool = True
    contacts: tuple[ContactWindow, ...] = ()

    @property
    def collapsed(self) -> bool:
        """Whether its body has given way."""
        return bool(self.members) and abs(self.body_plastic_mm) > COLLAPSED

    def as_row(self) -> dict[str, Any]:
        """Plain values for a table; contact windows, members and points are left out."""
        return {"name": self.name, "kind": self.kind, **self.values}

    def as_dict(self) -> dict[str, Any]:
        """Plain values, those of contact windows, members and points too."""
        parts = {"members": self.members, "points": self.points} if self.members else {}
        parts |= {"wheelsets": self.wheelsets} if self.wheelsets else {}
        contacts = [vars(window) for window in self.contacts]
        rows = {key: [part.as_row() for part in of_key] for key, of_key in parts.items()}
        return self.as_row() | {"contacts": contacts} | rows
