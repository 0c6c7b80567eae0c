"""Where the device law keeps its parameters and its state: a block of mjData.userdata for each simulation.

The block is part of MuJoCo's state row, so that every simulation of a batch has devices and plastic states of its
own, and the compiled law needs nothing else. It holds a header; records of vehicles, their point masses, interfaces,
elements, members of bodies that give and contact windows; in the vertical plane those of vehicles once more, wheelsets,
what interfaces have there, and lines; then the curves, and the ring of recorded speeds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from trainmj.collision import plane
from trainmj.collision.chain import WALL, Chain, Element, Interface
from trainmj.collision.envelope import Array, BoolArray, IntArray
from trainmj.collision.fields import (
    ELEMENT,
    FRAME,
    KEPT,
    N_CAR,
    N_CONTACT,
    N_ELEMENT,
    N_ENDS,
    N_FRAME,
    N_HEAD,
    N_JOINT,
    N_LINE,
    N_MEMBER,
    N_POINT,
    N_WHEEL,
    Car,
    Contact,
    Ends,
    Frame,
    Head,
    Joint,
    Line,
    Member,
    Point,
    Wheel,
)
from trainmj.collision.fields import Element as Field
from trainmj.collision.gear import N_DOF
from trainmj.collision.identity import code_hash
from trainmj.collision.kind import Law
from trainmj.collision.law import CRUSH, FOLLOWED, KINDS, SERIES

MAGIC = int(code_hash("collision")[:12], 16) + 0.5
"""First value of a block, made from the code of the law; the law leaves any other simulation of the process alone."""


_OF_MEMBERS = (
    *(Member.LEFT, Member.RIGHT, Member.STIFFNESS, Member.DAMPING),
    *(Member.COLLAPSE, Member.HARDENING, Member.LENGTH),
)
CODES = {kind: code for code, kind in enumerate(KINDS.values())}


def n_values(chain: Chain) -> int:
    """Values that the curves of a chain take."""
    laws = (law for interface in chain.interfaces for element in interface.elements for law in element.laws)
    return sum(curves.size for law in laws for curves in law.packed)


@dataclass(frozen=True)
class Layout:
    """Sizes and places of a block for chains of one size."""

    n_vehicle: int  # vehicles
    n_point: int  # their point masses
    n_interface: int  # interfaces
    n_element: int  # records of elements
    n_member: int  # members of bodies that give
    n_value: int  # room for curves
    n_frame: int = 0  # vehicles in the vertical plane
    n_wheel: int = 0  # their wheelsets
    n_line: int = 0  # lines of elements there
    n_ring: int = 0  # latest records of the speeds that the law keeps; with 0 it takes none and never rests
    within: int = 0  # steps that the law makes within one of MuJoCo's; with 0 MuJoCo makes each

    @classmethod
    def of(cls, chain: Chain, n_value: int = 0, n_ring: int = 0, within: int = 0) -> Layout:
        """The layout for a chain, with room for n_value values of curves or for those it has."""
        room = max(n_value, n_values(chain))
        return cls(
            len(chain.vehicles),
            len(chain.points),
            len(chain.interfaces),
            chain.n_places,
            len(chain.members),
            room,
            len(chain.vehicles) if chain.plane else 0,
            len(chain.wheelsets),
            len(chain.lines),
            n_ring,
            within,
        )

    @cached_property
    def _points(self) -> int:
        return N_HEAD + N_CAR * self.n_vehicle

    @cached_property
    def _joints(self) -> int:
        return self._points + N_POINT * self.n_point

    @cached_property
    def _elements(self) -> int:
        return self._joints + N_JOINT * self.n_interface

    @cached_property
    def _members(self) -> int:
        return self._elements + N_ELEMENT * self.n_element

    @cached_property
    def _contacts(self) -> int:
        return self._members + N_MEMBER * self.n_member

    @cached_property
    def _frames(self) -> int:
        return self._contacts + N_CONTACT * KEPT * self.n_vehicle

    @cached_property
    def _wheels(self) -> int:
        return self._frames + N_FRAME * self.n_frame

    @cached_property
    def _ends(self) -> int:
        return self._wheels + N_WHEEL * self.n_wheel

    @cached_property
    def _lines(self) -> int:
        return self._ends + N_ENDS * (self.n_interface if self.n_frame else 0)

    @cached_property
    def _curves(self) -> int:
        return self._lines + N_LINE * self.n_line

    @cached_property
    def _ring(self) -> int:
        return self._curves + self.n_value

    @cached_property
    def _motion(self) -> int:
        return self._ring + self.n_ring * self.n_vehicle

    @cached_property
    def size(self) -> int:
        """Length of the block."""
        return self._motion + (3 * self.n_point if self.within else 0)

    def head(self, block: Array, field: Head) -> Array:
        """(...) a field of the header of blocks (..., size)."""
        return np.asarray(block[..., field])

    def car(self, block: Array, field: Car) -> Array:
        """(..., n_vehicle) view of a vehicle field in blocks (..., size)."""
        return block[..., N_HEAD + field : self._points : N_CAR]

    def point(self, block: Array, field: Point) -> Array:
        """(..., n_point) view of a field of the point masses in blocks (..., size)."""
        return block[..., self._points + field : self._joints : N_POINT]

    def joint(self, block: Array, field: Joint) -> Array:
        """(..., n_interface) view of an interface field in blocks (..., size)."""
        return block[..., self._joints + field : self._elements : N_JOINT]

    def element(self, block: Array, field: Field) -> Array:
        """(..., n_element) view of a field of the records of elements in blocks (..., size)."""
        return block[..., self._elements + field : self._members : N_ELEMENT]

    def member(self, block: Array, field: Member) -> Array:
        """(..., n_member) view of a field of the members of bodies in blocks (..., size)."""
        return block[..., self._members + field : self._contacts : N_MEMBER]

    def contact(self, block: Array, field: Contact) -> Array:
        """(..., n_vehicle, KEPT) view of a field of the contact windows that are kept, in blocks (..., size)."""
        found = block[..., self._contacts + field : self._frames : N_CONTACT]
        return found.reshape(*block.shape[:-1], self.n_vehicle, KEPT)

    def frame(self, block: Array, field: Frame) -> Array:
        """(..., n_frame) view of a field of the vehicles in the vertical plane, in blocks (..., size)."""
        return block[..., self._frames + field : self._wheels : N_FRAME]

    def wheel(self, block: Array, field: Wheel) -> Array:
        """(..., n_wheel) view of a field of their wheelsets, in blocks (..., size)."""
        return block[..., self._wheels + field : self._ends : N_WHEEL]

    def ends(self, block: Array, field: Ends) -> Array:
        """(..., n_interface) view of what interfaces have in the vertical plane, in blocks (..., size)."""
        return block[..., self._ends + field : self._lines : N_ENDS]

    def line(self, block: Array, field: Line) -> Array:
        """(..., n_line) view of a field of the lines of elements there, in blocks (..., size)."""
        return block[..., self._lines + field : self._curves : N_LINE]

    def dissipated(self, block: Array) -> Array:
        """(..., n_interface) energy lost in all elements of each interface [J], in blocks (..., size) of one layout."""
        lost = self.element(block, Field.DISSIPATED) * self.element(block, Field.TIMES)
        first = (self.joint(block.reshape(-1, self.size)[0], Joint.FIRST) - self._elements) / N_ELEMENT
        return np.asarray(np.add.reduceat(lost, first.astype(int), axis=-1))

    def ring(self, block: Array) -> Array:
        """(..., n_ring, n_vehicle) speeds at the latest records, in blocks (..., size); the oldest is overwritten."""
        return block[..., self._ring : self._motion].reshape(*block.shape[:-1], self.n_ring, self.n_vehicle)

    def block(self, chain: Chain, dtype: npt.DTypeLike = np.float64) -> Array:
        """(size,) the block of a chain before its first step; of objects for one of symbols."""
        block = np.zeros(self.size, dtype)
        head = {
            Head.MAGIC: MAGIC,
            Head.N_VEHICLE: self.n_vehicle,
            Head.N_INTERFACE: self.n_interface,
            Head.N_MEMBER: self.n_member,
            Head.POINTS: self._points,
            Head.JOINTS: self._joints,
            Head.MEMBERS: self._members,
            Head.FRONT: chain.front,
            Head.TIME: -1.0,
            Head.STEP: chain.step,
            Head.REFINES: chain.refined,
            Head.FOLLOWS: chain.follows,
            Head.ROLLING: chain.rolling,
            Head.WINDOW: chain.steps_per_window,
            Head.CONTACTS: self._contacts,
            Head.THRESHOLD: chain.contact_threshold,
            Head.RING: self._ring,
            Head.LINGER: chain.linger,
        }
        if chain.plane:
            head |= {Head.PLANE: 1.0, Head.FRAMES: self._frames, Head.WHEELS: self._wheels, Head.ENDS: self._ends}
            head |= {Head.N_WHEEL: self.n_wheel}
        if self.within:
            head |= {Head.WITHIN: self.within, Head.MOTION: self._motion, Head.ASKED: -1.0}
            block[self._motion : self._motion + 2 * self.n_point] = np.concatenate([chain.start_qpos, chain.start_qvel])
        if self.n_ring:
            head |= {Head.STRIDE: chain.steps_per_record, Head.MOST: chain.n_records, Head.N_RING: self.n_ring}
        block[list(head)] = list(head.values())
        self.car(block, Car.MASS)[:] = chain.mass
        self.car(block, Car.POINTS)[:] = np.diff(chain.first)
        self.car(block, Car.SPEED)[:] = chain.speed
        self.point(block, Point.FRICTION_LIMIT)[:] = chain.friction
        self.point(block, Point.SPEED)[:] = chain.point_speed
        if chain.grade:
            self.point(block, Point.GRADE)[:] = chain.grade_force
        for i, vehicle in enumerate(chain.vehicles):
            if vehicle.brake:
                part = chain.points_of(i)
                carried = chain.carried[part]
                self.point(block, Point.BRAKE)[part] = vehicle.brake.force * carried
                self.point(block, Point.BRAKE_DELAY)[part] = vehicle.brake.delay
                self.point(block, Point.BRAKE_RISE)[part] = vehicle.brake.rise
                self.point(block, Point.BRAKE_MOST)[part] = [vehicle.brake.most * c if c else 0.0 for c in carried]
        for field in _OF_MEMBERS if chain.members else ():
            self.member(block, field)[:] = [getattr(member, field.name.lower()) for member in chain.members]
        self.member(block, Member.END_TIME)[:] = -1.0
        for k, member in enumerate(chain.members):
            if member.span:
                self.member(block, Member.CAR)[k] = len(Head) + len(Car) * member.vehicle
        self.joint(block, Joint.STROKE)[chain.front] = -chain.gap
        self.joint(block, Joint.FIRST_FORCE_TIME)[:] = -1.0
        at, curves = self._elements, self._curves
        for k, interface in enumerate(chain.interfaces):
            self.joint(block, Joint.LEFT)[k], self.joint(block, Joint.RIGHT)[k] = chain.ends(interface)
            self.joint(block, Joint.CAR)[k] = len(Head) + len(Car) * interface.left
            self.joint(block, Joint.FIRST)[k], self.joint(block, Joint.COUNT)[k] = at, len(interface.elements)
            stroke = -chain.gap if k == chain.front else 0.0
            for element in interface.elements:
                curves = _write(block, at, curves, element, stroke, chain.follows)
                at += N_ELEMENT * element.n_places
        if chain.plane:
            self._write_plane(block, chain)
        return block

    def _write_plane(self, block: Array, chain: Chain) -> None:
        """Write what the vertical plane needs."""
        frames = [self._frames + len(Frame) * i for i in range(self.n_frame)]
        for i, at in enumerate(frames):
            _write_frame(block[at : at + len(Frame)], chain, i)
        loads = [chain.load(w) for w in range(self.n_wheel)]
        self.wheel(block, Wheel.PRELOAD)[:] = self.wheel(block, Wheel.LOAD_MIN)[:] = loads
        self.wheel(block, Wheel.LIFT_TIME)[:] = -1.0
        self.ends(block, Ends.STEP_TIME)[:] = -1.0
        at, touching = self._lines, chain.start_qpos
        touching[list(chain.first_dof[:-1])] = 0.0
        plane.turn(block, touching)
        for k, interface in enumerate(chain.interfaces):
            self.ends(block, Ends.LINE)[k] = at
            left, right = frames[interface.left], -1 if interface.right == WALL else frames[interface.right]
            if right < 0 and len(interface.devices) == 1:  # a wall without a height of its own
                self.ends(block, Ends.WALL)[k] = chain.rise_at_start(interface.left)
            for element in interface.elements:
                _write_line(block[at : at + len(Line)], chain, interface, element)
                block[at + Line.ZERO] = plane.along(block, at, left, right, touching, np.zeros_like(touching))[0]
                at += len(Line)


def _write_frame(frame: Array, chain: Chain, i: int) -> None:
    """Write a vehicle into its record."""
    vehicle, gear = chain.vehicles[i], chain.vehicles[i].gear
    frame[[Frame.DOF, Frame.DOFS]] = chain.first_dof[i], 1 if gear is None else N_DOF
    frame[[Frame.LEFT_END, Frame.RIGHT_END]] = chain.end_arms(i)
    frame[FRAME.Q0 : FRAME.Q10 + 1][: int(frame[Frame.DOFS])] = chain.start_dofs(i)
    frame[Frame.V0] = vehicle.speed
    if gear is None:
        return
    s, p = gear.secondary, gear.primary
    values = {
        Frame.HEIGHT: gear.cog_height + gear.offset,
        Frame.OFFSET: gear.offset,
        Frame.ARM_0: gear.arms[0],
        Frame.ARM_1: gear.arms[1],
        Frame.DROP: gear.drop,
        Frame.LINK: gear.link_height + gear.offset,
        Frame.BASE: 0.5 * gear.wheelbase,
        Frame.AXLE: gear.axle_height - gear.link_height,
        Frame.RAIL_STIFFNESS: gear.rail_stiffness,
        Frame.RAIL_DAMPING: gear.rail_damping,
        Frame.DAMPING_S: s.damping,
        Frame.LIFT_S: s.lift_stop,
        Frame.BUMP_S: s.bump_stop,
        Frame.STOP_S: s.stop,
        Frame.DAMPING_P: p.damping,
        Frame.LIFT_P: p.lift_stop,
        Frame.BUMP_P: p.bump_stop,
        Frame.STOP_P: p.stop,
        Frame.PITCH_MAX: gear.pitch,
        Frame.PITCH_MIN: gear.pitch,
    }
    frame[list(values)] = list(values.values())


def _write_line(record: Array, chain: Chain, interface: Interface, element: Element) -> None:
    """Write the line of an element into its record."""
    line = element.line
    assert line is not None  # every element in the plane has one
    left, right = line.left, line.right
    left_x, left_z = chain.point_of_line(interface.left, 1, left)
    at_wall = right.pin, right.height
    right_x, right_z = at_wall if line.walled else chain.point_of_line(interface.right, 0, right)
    values = {
        Line.STRUT: line.strut,
        Line.LEFT_X: left_x,
        Line.LEFT_Z: left_z,
        Line.RIGHT_X: right_x,
        Line.RIGHT_Z: right_z,
        Line.LENGTH: left.pin + right.pin,
        Line.FREE_LEFT: left.free,
        Line.FREE_RIGHT: right.free,
        Line.FRICTION: line.friction,
        Line.TOOTH: line.tooth,
        Line.TIE: line.tie,
        Line.OVERLAP: line.overlap,
        Line.INNER: line.inner,
        Line.END_LEFT: np.inf,
        Line.END_RIGHT: np.inf,
        Line.MET_TIME: -1.0,
        Line.OFF_TIME: -1.0,
    }
    if line.strut and element.sign > 0.0:  # the draw gear in it has no stops of its own
        values |= {Line.SWING_LEFT: left.swing, Line.SWING_RIGHT: right.swing}
    if line.shears:
        values |= {Line.END_LEFT: element.laws[0].curves[0][0, -1], Line.END_RIGHT: element.laws[-1].curves[0][0, -1]}
    record[list(values)] = list(values.values())


def alone(element: Element, follows: bool = False) -> Array:
    """A block of one element, its record at 0, as the laws take it: to press it by itself.

    With follows it is followed through what happens to it within a step. See :func:`trainmj.collision.element.advance`.
    """
    records = N_ELEMENT * element.n_places
    block = np.zeros(records + sum(curves.size for law in element.laws for curves in law.packed))
    _write(block, 0, records, element, 0.0, follows)
    return block


def _write(block: Array, at: int, curves: int, element: Element, stroke: float, follows: bool) -> int:
    """Write an element that begins at a place, its curves to another one; where the next curves go."""
    pair = len(element.laws) == 2
    own = element.share * (element.sign * stroke - element.start)
    values = {
        ELEMENT.NEXT: N_ELEMENT * element.n_places,
        ELEMENT.KIND: SERIES,
        ELEMENT.SIGN: element.sign,
        ELEMENT.SHARE: element.share,
        ELEMENT.TIMES: 1.0 / element.share,
        ELEMENT.RIGHT_ONLY: element.right_only,
        ELEMENT.START: element.start,
        ELEMENT.BREAK: element.breaks,
        ELEMENT.STROKE: own,
        ELEMENT.END_TIME: -1.0,
    }
    block[[at + place for place in values]] = list(values.values())
    for n, law in enumerate(element.laws):
        e = at + N_ELEMENT * (n + 1) if pair else at
        curves = _write_law(block, e, curves, law)
        if pair:
            block[e + ELEMENT.START], block[e + ELEMENT.STROKE] = element.starts[n], 0.5 * own
        elif follows and block[e + ELEMENT.KIND] == CRUSH:
            block[e + ELEMENT.KIND] = FOLLOWED
        elif follows:
            block[e + ELEMENT.FOLLOWED] = 1.0
    return curves


def _write_law(block: Array, e: int, curves: int, law: Law) -> int:
    """Write a law into the record at a place, its curves to another one; where the next curves go."""
    block[e + ELEMENT.KIND] = CODES[law.kind]
    block[e + ELEMENT.END], block[e + ELEMENT.END_TIME] = law.end, -1.0
    block[e + ELEMENT.P0 : e + ELEMENT.P9 + 1] = law.parameters
    for place, packed in zip((ELEMENT.CURVE, ELEMENT.CURVE_2), law.packed, strict=False):
        block[e + place] = curves
        block[curves : curves + packed.size] = packed
        curves += packed.size
    return curves


@dataclass(frozen=True)
class Tallied:
    """A field that a collision leaves behind."""

    name: str  # of the attribute of a :class:`Tally`
    over: tuple[str, ...]  # what it has a value for, such as "vehicle"; nothing for the whole collision
    unit: str  # of its values
    meaning: str  # in words
    view: Callable[[Layout, Array], Array]  # of it, in blocks (..., size)


_FIELDS: tuple[tuple[type[Any], tuple[str, ...], str, Callable[..., Array]], ...] = (
    (Head, (), "", Layout.head),
    (Car, ("vehicle",), "", Layout.car),
    (Point, ("point",), "point_", Layout.point),
    (Joint, ("interface",), "", Layout.joint),
    (Field, ("element",), "element_", Layout.element),
    (Member, ("member",), "member_", Layout.member),
    (Contact, ("vehicle", "contact"), "contact_", Layout.contact),
    (Frame, ("frame",), "frame_", Layout.frame),
    (Wheel, ("wheelset",), "wheel_", Layout.wheel),
    (Ends, ("ends",), "ends_", Layout.ends),
    (Line, ("line",), "line_", Layout.line),
)

TALLY = (
    *(
        Tallied(f"{prefix}{field.name.lower()}", over, field.unit, field.meaning, partial(view, field=field))
        for fields, over, prefix, view in _FIELDS
        for field in fields
        if field.tallied
    ),
    Tallied(
        "dissipated",
        ("interface",),
        "J",
        "energy lost in all its elements, added up from their laws and not from the work",
        Layout.dissipated,
    ),
)
"""Every tallied field: of the header, vehicles, their points, interfaces, elements, members, contact windows, and of
vehicles, wheelsets, interfaces and lines in the vertical plane.
"""

_BY_NAME = {tallied.name: tallied for tallied in TALLY}


class Tally:
    """What the device law counts at every step, as it stands at the end of a collision; all in SI.

    Its attributes are the fields of :data:`TALLY` by name: (n_vehicle,), (n_point,), (n_interface,) or (n_member,)
    arrays in the order of the chain, (n_element,) arrays of the records of elements in the order of the interfaces, two
    laws in series behind their pair; (n_vehicle, KEPT) of contact windows, of which the first ``contacts`` are filled;
    plain numbers for the whole collision. In the vertical plane ``frame_`` names (n_vehicle,) arrays, ``wheel_``
    (n_wheelset,), ``ends_`` (n_interface,) and ``line_`` (n_line,), as :class:`Chain` has wheelsets and lines; along
    the track these are empty.
    """

    def __init__(self, **values: Any) -> None:
        """Take the value of each field by name."""
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:
        """Say what is missing; what there is, is found without this."""
        raise AttributeError(f"the tally has no {name!r}; it has {', '.join(vars(self))}")

    @property
    def valid_until(self) -> float:
        """When the first curve, member of a body or line ended, with nothing stated behind it [s]; or infinite."""
        return float(Tallies.of_one(self).valid_until[0])

    @classmethod
    def of(cls, layout: Layout, block: Array) -> Tally:
        """The tally in a simulation's block of user data (size,)."""
        values: dict[str, Any] = {t.name: t.view(layout, block) for t in TALLY}
        values = {name: value.copy() if value.ndim else float(value) for name, value in values.items()}
        return cls(**values | {"over": bool(values["over"])})


class Tallies:
    """The tallies of many collisions: fields of the same names, with an axis of the cases before their own.

    What is of the whole collision is (n_case,), what a vehicle has (n_case, n_vehicle), and so on. A field is looked up
    when it is asked for.
    """

    def __init__(self, look_up: Callable[[str], Array]) -> None:
        """Take what finds a field (n_case, ...) by its name."""
        self._look_up = look_up

    def __getattr__(self, name: str) -> Array:
        """A field by its name."""
        if name.startswith("__"):
            raise AttributeError(name)
        found = np.asarray(self._look_up(name))
        self.__dict__[name] = found
        return found

    @classmethod
    def of(cls, layout: Layout, blocks: Array) -> Tallies:
        """Those in the blocks (n_case, size) of simulations, which must not change any more."""
        return cls(lambda name: _BY_NAME[name].view(layout, blocks))

    @classmethod
    def of_one(cls, tally: Tally) -> Tallies:
        """That of one collision."""
        return cls(lambda name: np.asarray(getattr(tally, name))[None])

    def take(self, places: IntArray) -> Tallies:
        """Those of some cases, in this order."""
        return Tallies(lambda name: np.asarray(getattr(self, name)[places]))

    @cached_property
    def is_over(self) -> BoolArray:
        """(n_case,) whether no device was pressed any more at the end; otherwise the time limit cut it off."""
        return np.asarray(self.over != 0.0)

    @cached_property
    def valid_until(self) -> Array:
        """(n_case,) when the first curve, member of a body or line ended [s]; see :class:`Tally`."""
        times = np.concatenate([self.element_end_time, self.member_end_time, self.line_off_time], axis=-1)
        return np.asarray(np.where(times >= 0.0, times, np.inf).min(axis=-1, initial=np.inf))
