"""What a simulation keeps of its vehicles, interfaces and devices, value by value, and where.

The values of a simulation stand in one block (:mod:`trainmj.collision.block`). A field is its place among those of its
kind; the laws of devices find their parameters and state by it. All values are float64 in SI.
"""

from __future__ import annotations

from collections import namedtuple
from enum import IntEnum
from typing import Any, Protocol, Self


class Block(Protocol):
    """The values of a simulation, or of an element alone: an array, a list, or bare memory in compiled functions."""

    def __getitem__(self, place: int, /) -> float:
        """A value."""

    def __setitem__(self, place: int, value: float, /) -> None:
        """Put a value in place of one."""


class _Field(IntEnum):
    """A field: its place among those of its kind, with unit and meaning."""

    unit: str  # of its value
    meaning: str  # in words
    tallied: bool  # whether it is part of what a collision leaves behind

    def __new__(cls, unit: str, meaning: str, tallied: bool = False) -> Self:
        """Count the fields in the order in which they are written."""
        field = int.__new__(cls, len(cls.__members__))
        field._value_ = len(cls.__members__)
        field.unit, field.meaning, field.tallied = unit, meaning, tallied
        return field


class Head(_Field):
    """Header fields."""

    MAGIC = "1", "marks the block of a simulation with the device law"
    N_VEHICLE = "1", "vehicles"
    N_INTERFACE = "1", "interfaces"
    N_MEMBER = "1", "members of bodies that give"
    POINTS = "1", "place of the first point in the block"
    JOINTS = "1", "place of the first interface"
    MEMBERS = "1", "place of the first member"
    TIME = "s", "time of the last evaluation; -1 before the first", True
    OVER = "1", "1 when no interface carries force or comes closer, or all vehicles stand, for LINGER", True
    BUSY = "s", "time of the last evaluation at which this was not so"
    LINGER = "s", "how long it must be so; 0 where no body gives and no vehicle stands on bogies"
    IMPULSE = "N s", "impulse of rails, brakes, grade and wall on all vehicles together", True
    STRIDE = "1", "whole steps from one record of the speeds to the next; 0 for no records"
    DUE = "1", "whole steps until the next record"
    RECORDS = "1", "records taken so far"
    MOST = "1", "records after which the simulation is done"
    DONE = "1", "1 when, at a record, it was over, out of records or not finite: the law rests from then on"
    N_RING = "1", "records that are kept"
    RING = "1", "place of the first of them in the block"
    FRONT = "1", "interface at which the two sides meet"
    ROLLING = "1", "1 where brakes, grade or unequal friction may bring vehicles together again"
    STEP = "s", "whole step"
    REFINES = "1", "1 where steps are made smaller at narrow parts of curves"
    PARTS_LEFT = "1", "smaller steps left in this whole step"
    PART = "s", "a smaller step"
    GRID = "1", "whole steps begun so far"
    STEPS = "1", "steps of any size, made so far", True
    ELAPSED = "s", "time from the evaluation before the last one to that"
    WINDOW = "1", "whole steps in a window of means; 0 where none are asked for"
    CONTACTS = "1", "place of the first contact window in the block"
    THRESHOLD = "N", "net force of the devices above which a vehicle is in contact"
    PLANE = "1", "1 where vehicles move in the vertical plane"
    FRAMES = "1", "place of the first vehicle in the plane"
    WHEELS = "1", "place of the first wheelset"
    N_WHEEL = "1", "wheelsets"
    ENDS = "1", "place of what the first interface has in the plane"
    WITHIN = "1", "steps that the law makes within one of MuJoCo's; 0 where MuJoCo makes each"
    MOTION = (
        "1",
        "place of the positions of the points that the law then follows; speeds, 1 / masses come behind",
    )
    CLOCK = "s", "time that it has come to"
    ASKED = "s", "time at which MuJoCo asked last; -1 before it did"
    FOLLOWS = "1", "1 where devices are followed through what happens to them within a step"
    STRAYED = "1", "largest distance of a point of MuJoCo's from where the law has come to, over 1 m and its position"


class Car(_Field):
    """Fields of a vehicle as a whole."""

    POINTS = "1", "its point masses: one, or those of a body that gives"
    MASS = "kg", "mass"
    NET = "N", "force of all devices"
    NET_BEFORE = "N", "the same at the evaluation before"
    RAIL = "N", "rail friction and brake force"
    SLOPE = "N", "force of the grade along +x"
    SPEED = "m/s", "speed of its centre of mass at the last evaluation", True
    FRICTION_WORK = "J", "work done against rail friction", True
    BRAKE_WORK = "J", "work done against the brake", True
    GRADE_WORK = "J", "work done against the grade", True
    DEVICE_FORCE = "N", "largest |force| by the devices alone"
    TOTAL_FORCE = "N", "largest |force|"
    DEVICE_PEAK = "m/s2", "largest |acceleration| by the devices alone", True
    TOTAL_PEAK = "m/s2", "largest |acceleration|, rail friction, brake and grade included", True
    UNSEEN_PEAK = "m/s2", "largest |acceleration| by the devices at a peak of a curve between two steps", True
    PEAK_RISE = "N", "by how much the largest |force| by the devices is above that of the step before", True
    PEAK_FALL = "N", "by how much it is above that of the step behind", True
    SWUNG = "N", "sum of |changes| of the force by the devices so far"
    PEAK_SWUNG = "N", "the same when the force was largest", True
    WINDOW_IMPULSE = "N s", "impulse of the devices in the present window of means", True
    WINDOW_PEAK = "m/s2", "largest |mean acceleration| by the devices over one of the windows before", True
    SPEED_FIRST = "m/s", "speed at the first force at the front", True
    SPEED_LAST = "m/s", "speed at the last force at the front", True
    OPEN = "1", "contact window: 0 none, 1 begun at the last evaluation, 2 begun before", True
    OPEN_START = "s", "its start", True
    OPEN_IMPULSE = "N s", "impulse of the devices in it so far, along +x", True
    CONTACTS = "1", "contact windows that have ended", True
    SHORTENED = "m", "shortening of its body, while it is added up"
    SHORTENED_MAX = "m", "largest shortening of its body", True


class Point(_Field):
    """Fields of a point mass: a vehicle, or a part of one with a body that gives."""

    FRICTION_LIMIT = "N", "largest rail friction"
    BRAKE = "N", "brake force when fully applied"
    BRAKE_DELAY = "s", "time at which the brake begins to act"
    BRAKE_RISE = "s", "time that its force takes to rise"
    BRAKE_MOST = "N", "what the rail can take of it by adhesion"
    BRAKING = "N", "what the brake can give now"
    GRADE = "N", "force of the grade along +x"
    LOAD = "N", "force of devices, while it is added up"
    INNER = "N", "force of the members of its body, while it is added up"
    LATE = "N s", "impulse by which the forces of its devices fell short in the step before, while it is added up"
    FORCE = "N", "force of devices, members, rail, brake and grade"
    SPEED = "m/s", "speed at the last evaluation", True
    FRICTION = "N", "rail friction and brake force"
    PEAK = "m/s2", "largest |acceleration| in a body that gives", True
    GIVEN = "N", "force that MuJoCo is given where the law makes several steps within one of MuJoCo's"


class Member(_Field):
    """Fields of a member of a body: a spring with a dashpot that yields, between two point masses."""

    LEFT = "1", "index of the point on its left"
    RIGHT = "1", "index of the point on its right"
    CAR = "1", "place of its vehicle in the block; 0 for the link of a bogie"
    STIFFNESS = "N/m", "stiffness"
    DAMPING = "N s/m", "dashpot beside it"
    COLLAPSE = "N", "force at which it yields"
    HARDENING = "N/m", "slope of that force over plastic travel"
    LENGTH = "m", "its length; infinite of the link of a bogie"
    STROKE = "m", "shortening at the last evaluation", True
    RATE = "m/s", "rate of its elastic part"
    FORCE = "N", "force of the spring", True
    PLASTIC = "m", "plastic shortening", True
    TRAVEL = "m", "plastic travel, to and fro"
    STROKE_MAX = "m", "largest shortening", True
    FORCE_MAX = "N", "largest force, of spring and dashpot", True
    DISSIPATED = "J", "energy lost", True
    VISCOUS = "J", "part of it that was lost in the dashpot", True
    END_TIME = "s", "time at which nothing of its length was left; -1 if something is", True


class Contact(_Field):
    """Fields of a contact window of a vehicle that is kept."""

    START = "s", "time at which the net force of the devices away from the impact rose above the threshold", True
    END = "s", "time at which it fell to it again", True
    MEAN = "m/s2", "its mean over the mass", True


class Joint(_Field):
    """Fields of an interface."""

    LEFT = "1", "index of the point on its left"
    RIGHT = "1", "index of the point on its right; -1 for the wall"
    CAR = "1", "place of the vehicle on its left in the block; the next one is on its right"
    FIRST = "1", "place of its first element in the block"
    COUNT = "1", "its elements"
    STROKE = "m", "stroke at the last evaluation", True
    FORCE = "N", "force; negative where it pulls", True
    STROKE_MAX = "m", "largest stroke", True
    STROKE_MAX_TIME = "s", "time of the largest stroke", True
    FORCE_MAX = "N", "largest force", True
    FORCE_RISE = "N", "by how much that is above the force of the step before", True
    FORCE_FALL = "N", "by how much it is above the force of the step behind", True
    PULL_MAX = "N", "largest pull", True
    ABOVE = "N", "what the force was larger on the way from the evaluation before"
    LATE = "N s", "impulse by which it fell short in the step before the last evaluation"
    UNSEEN_FORCE = "N", "largest force at a peak of a curve between two steps", True
    FIRST_FORCE_TIME = "s", "time of the first force; -1 where there was none", True
    LAST_FORCE_TIME = "s", "time of the last force", True


class Element(_Field):
    """Fields of an element of an interface: a law, or two in series, which then follow as elements of their own.

    The stroke of an element is ``SHARE (SIGN u - START)`` for a stroke u of its interface; its energies are those of
    one device, of which the interface has ``TIMES``.
    """

    NEXT = "1", "from here to the next element"
    KIND = "1", "code of its law; -1 for two in series, -2 for crush that is followed within a step"
    SIGN = "1", "1 where it pushes, -1 where it pulls"
    SHARE = "1", "part of the stroke that it takes: a half where it stands for two equal devices in series"
    TIMES = "1", "devices that it stands for, 1 / SHARE; 0 for a law in series, whose pair stands for it"
    RIGHT_ONLY = "1", "1 where its one law is that of the right side alone"
    START = "m", "stroke of the interface at which it engages"
    BREAK = "N", "force at which it breaks for good"
    BROKEN = "1", "1 when it has"
    END = "m", "stroke at which its curve ends, where nothing is stated behind it"
    CURVE = "1", "place of its first curve in the block"
    SEGMENT = "1", "segment of it at which the search starts"
    CURVE_2 = "1", "place of its second curve"
    SEGMENT_2 = "1", "segment of that"
    P0 = "", "parameter of its law"
    P1 = "", "parameter of its law"
    P2 = "", "parameter of its law"
    P3 = "", "parameter of its law"
    P4 = "", "parameter of its law"
    P5 = "", "parameter of its law"
    P6 = "", "parameter of its law"
    P7 = "", "parameter of its law"
    P8 = "", "parameter of its law"
    P9 = "", "parameter of its law"
    STROKE = "m", "stroke at the last evaluation", True
    FORCE = "N", "force", True
    PEAK = "N", "largest force on the way from the evaluation before"
    FOLLOWED = "1", "1 of another law that is followed"
    RATE = "m/s", "mean rate of the step before"
    BRANCH = (
        "1",
        "of crush that is followed: 0 no force, 1 on its spring, 2 crushing, 3 at its curve by its dashpot",
    )
    LATE = "N s", "impulse on the way from the evaluation before, less that of the two forces there and here"
    STATE_0 = "m", "first state of its law, such as the stroke at which the force would vanish", True
    STATE_1 = "m", "second state of its law", True
    DISSIPATED = "J", "energy lost", True
    VISCOUS = "J", "part of it that was lost by speed: in a dashpot, an orifice", True
    STROKE_MAX = "m", "largest stroke", True
    END_TIME = "s", "time at which its curve ended, where nothing is stated behind it; -1 if it did not", True


class Frame(_Field):
    """Fields of a vehicle in the vertical plane; see :mod:`trainmj.collision.gear`."""

    DOF = "1", "its first degree of freedom"
    DOFS = "1", "how many it has: 11 on bogies, 1 where it only slides"
    HEIGHT = "m", "height of the centre of gravity of its body where it stands as designed, offset included"
    OFFSET = "m", "by which it stands higher"
    LEFT_END = "m", "from that centre to its left end along +x"
    RIGHT_END = "m", "from that centre to its right end along +x"
    ARM_0 = "m", "from that centre to the left bogie along +x"
    ARM_1 = "m", "from that centre to the right bogie along +x"
    DROP = "m", "from that centre up to the links"
    LINK = "m", "height of the links above the rail, offset included"
    BASE = "m", "half the wheelbase"
    AXLE = "m", "from the links up to the axles"
    RAIL_STIFFNESS = "N/m", "stiffness of the contact of a wheelset with the rail"
    RAIL_DAMPING = "N s/m", "damping of that"
    DAMPING_S = "N s/m", "dampers of the secondary suspension of a bogie"
    LIFT_S = "m", "its extension at the lift stop"
    BUMP_S = "m", "its compression at the bump stop"
    STOP_S = "N/m", "stiffness of its stops"
    DAMPING_P = "N s/m", "dampers of the primary suspension of a wheelset"
    LIFT_P = "m", "its extension at the lift stop"
    BUMP_P = "m", "its compression at the bump stop"
    STOP_P = "N/m", "stiffness of its stops"
    Q0 = "m", "degree of freedom at the last evaluation", True
    Q1 = "m", "degree of freedom at the last evaluation", True
    Q2 = "rad", "degree of freedom at the last evaluation", True
    Q3 = "m", "degree of freedom at the last evaluation", True
    Q4 = "rad", "degree of freedom at the last evaluation", True
    Q5 = "m", "degree of freedom at the last evaluation", True
    Q6 = "m", "degree of freedom at the last evaluation", True
    Q7 = "m", "degree of freedom at the last evaluation", True
    Q8 = "rad", "degree of freedom at the last evaluation", True
    Q9 = "m", "degree of freedom at the last evaluation", True
    Q10 = "m", "degree of freedom at the last evaluation", True
    V0 = "m/s", "its rate", True
    V1 = "m/s", "its rate", True
    V2 = "rad/s", "its rate", True
    V3 = "m/s", "its rate", True
    V4 = "rad/s", "its rate", True
    V5 = "m/s", "its rate", True
    V6 = "m/s", "its rate", True
    V7 = "m/s", "its rate", True
    V8 = "rad/s", "its rate", True
    V9 = "m/s", "its rate", True
    V10 = "m/s", "its rate", True
    G0 = "N", "force along the degree of freedom, of everything but weight and suspension springs"
    G1 = "N", "force along the degree of freedom"
    G2 = "N m", "force along the degree of freedom"
    G3 = "N", "force along the degree of freedom"
    G4 = "N m", "force along the degree of freedom"
    G5 = "N", "force along the degree of freedom"
    G6 = "N", "force along the degree of freedom"
    G7 = "N", "force along the degree of freedom"
    G8 = "N m", "force along the degree of freedom"
    G9 = "N", "force along the degree of freedom"
    G10 = "N", "force along the degree of freedom"
    LEVER = "m", "of the rails about the centre of gravity of its body, mean of the wheelsets"
    LEVER_0 = "m", "of the rails about the link of the left bogie, mean of its wheelsets"
    LEVER_1 = "m", "of the rails about the link of the right bogie, mean of its wheelsets"
    SINE = "1", "of its pitch"
    COSINE = "1", "of its pitch"
    SINE_0 = "1", "of the pitch of the left frame against the track"
    SINE_1 = "1", "of the pitch of the right frame against the track"
    PITCH_MAX = "rad", "largest pitch", True
    PITCH_MIN = "rad", "least pitch", True
    HEAVE_MAX = "m", "largest rise of the centre of gravity of its body", True
    HEAVE_MIN = "m", "least rise of that", True
    DAMPED = "J", "energy lost in the dampers of its suspensions", True
    RAILED = "J", "energy lost in the contact of its wheelsets with the rails", True


class Wheel(_Field):
    """Fields of a wheelset in the vertical plane."""

    PRELOAD = "N", "its load at rest"
    LOAD = "N", "its load", True
    RISE = "m", "its rise from where it stands", True
    LOAD_MIN = "N", "its least load", True
    LIFT_MAX = "m", "its largest lift off the rail; 0 if it stays on it", True
    LIFT_TIME = "s", "time of that", True
    OFF = "s", "how long it was off the rail", True


class Ends(_Field):
    """Fields of an interface in the vertical plane."""

    LINE = "1", "place of its first line"
    RATE = "m/s", "rate of the stroke"
    WALL = "m", "what a flat wall counts as risen: as much as the end before it at the start; 0 of others"
    STEP = "m", "rise of the end on its left less that of the one on its right", True
    STEP_MAX = "m", "largest magnitude of that while a device carries force", True
    STEP_TIME = "s", "time of that; -1 if none ever did", True


class Line(_Field):
    """Fields of the line along which an element acts in the vertical plane; see :mod:`trainmj.collision.line`."""

    STRUT = "1", "1 of a strut between pins, 0 of two faces"
    LEFT_X = "m", "its left point from the centre of gravity of the body, along the body"
    LEFT_Z = "m", "likewise, along the vertical of the body"
    RIGHT_X = "m", "its right point likewise"
    RIGHT_Z = "m", "likewise; on a wall the height above the rail"
    LENGTH = "m", "distance of the pins of a strut along the track where the vehicles touch; 0 of faces"
    ZERO = "m", "how much closer its points are than designed as the vehicles stand, were there no gap"
    FREE_LEFT = "rad", "angle at the left pin up to the swing stop"
    FREE_RIGHT = "rad", "angle at the right pin up to the swing stop"
    SWING_LEFT = "N m/rad", "stiffness of the stop at the left pin"
    SWING_RIGHT = "N m/rad", "stiffness of the stop at the right pin"
    FRICTION = "1", "coefficient of the vertical tie of two faces"
    TOOTH = "N", "part of its capacity that does not depend on the force"
    TIE = "N/m", "its stiffness"
    OVERLAP = "m", "step at which the faces slide off each other"
    END_LEFT = "m", "stroke of its law, or of the left one of two, at which a strut has sheared; else infinite"
    END_RIGHT = "m", "stroke of the right one of two laws at which it has"
    INNER = "1", "1 of a strut between vehicles of a train, which is coupled from the start"
    COUPLED = "1", "1 when a strut is coupled: between the two sides from where its ends touch"
    SET_LEFT = "rad", "angle beyond the free one at the left pin when it coupled, from which its stop counts"
    SET_RIGHT = "rad", "likewise at the right pin"
    DEAD = "1", "1 when a strut has sheared"
    PUSH = "N", "its force along the track"
    TIED = "N", "force of the tie, down on the left where it is positive", True
    HELD = "m", "slip across the line at which the tie has no force", True
    ENGAGED = "m", "slip across the line at which the faces engaged last"
    MET = "m", "slip across the line when it first carried force", True
    MET_TIME = "s", "time of that; -1 if it never did", True
    SLIP_MAX = "m", "largest way that engaged faces have slipped from where they engaged", True
    TIE_MAX = "N", "largest magnitude of the force of the tie", True
    TIE_LOST = "J", "energy lost in the tie", True
    TURN_LEFT = "rad", "angle of the strut against the left body beyond the free one", True
    TURN_RIGHT = "rad", "likewise at the right", True
    SWING_MAX = "N m", "largest moment of a swing stop", True
    SWING_LOST = "J", "energy of the swing stops when the strut sheared", True
    OFF_TIME = "s", "time at which one face slid off the other, or the pins met; -1 if not", True


def places(fields: type[IntEnum]) -> Any:
    """The places of fields as plain whole numbers by their names, such as ``places(Head).TIME``."""
    kind: Any = namedtuple("places", [field.name for field in fields])  # type: ignore[misc]
    return kind(*map(int, fields))


HEAD, CAR, POINT, CONTACT = places(Head), places(Car), places(Point), places(Contact)
JOINT, ELEMENT, MEMBER = places(Joint), places(Element), places(Member)
FRAME, WHEEL, ENDS, LINE = places(Frame), places(Wheel), places(Ends), places(Line)
"""Numba takes no members of an Enum as indices."""

N_HEAD, N_CAR, N_POINT, N_CONTACT = len(Head), len(Car), len(Point), len(Contact)
N_JOINT, N_ELEMENT, N_MEMBER = len(Joint), len(Element), len(Member)
N_FRAME, N_WHEEL, N_ENDS, N_LINE = len(Frame), len(Wheel), len(Ends), len(Line)
N_PARAMETER = ELEMENT.P9 - ELEMENT.P0 + 1

KEPT = 100
"""Contact windows of a vehicle that are kept: the first ones, and in the last place the worst of all that follow."""

LASTING = 0.030
"""Shortest contact window that may be the worst one [s]."""
