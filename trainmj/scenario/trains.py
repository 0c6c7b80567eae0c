"""Trains, vehicles and obstacles of a scenario file."""

from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field

from trainmj.errors import InputError, close_match
from trainmj.files.parts import WHOLE, Above, Either, Part
from trainmj.files.tables import Table, first_of_no_number
from trainmj.scenario.bodies import Body, BodySpec
from trainmj.scenario.curves import TableFile
from trainmj.scenario.ranges import LEAST_MASS, Force, Friction, Label, Length, Mass, Seconds

RIGID_WALL = "rigid_wall"
End = Literal["front", "rear"]
"""An end of a train."""
MAX_VEHICLES = 400
KG = 1e-3  # in t
PASSENGERS = ("seats", "share", "kg")
"""The keys of a load that go together."""
_SUMS = {"total", "totals", "sum", "summe", "gesamt", "somme", "totale", "mean", "average", "mittel", "mittelwert"}
_SHOWN = 60  # characters of a head in a message


class Load(Part):
    """What is added to the mass of a vehicle: passengers, seats x share x kg, and freight."""

    seats: Annotated[float, Field(ge=0, le=5000, allow_inf_nan=False)] | None = Field(
        default=None, description="seats, or places, of a vehicle"
    )
    share: (
        Annotated[float, Field(ge=0, le=10, allow_inf_nan=False), Above("a share has no unit; divide by 100 if in %")]
        | None
    ) = Field(default=None, description="share of the seats that is taken; 0.5 is half of them")
    kg: (
        Annotated[float, Field(ge=0, le=500, allow_inf_nan=False), Above("masses of passengers are in kg each")] | None
    ) = Field(default=None, description="mass of one passenger [kg]")
    freight_t: (
        Annotated[
            float, Field(ge=0, le=200, allow_inf_nan=False), Above("freight is in t; divide by 1000 if it is in kg")
        ]
        | None
    ) = Field(default=None, description="mass of freight, baggage or anything else [t]")


_NO_LOAD = Load()


class Brakes(Part):
    """Brakes of a vehicle."""

    delay_s: Seconds = Field(default=0.0, description="from the first moment to where the brakes begin to act [s]")
    rise_s: Seconds = Field(default=0.0, description="from there to their whole force [s]; linear")
    adhesion: Annotated[Friction, Field(gt=0)] | None = Field(
        default=None, description="between wheel and rail: the force is at most adhesion x weight; no bound if left out"
    )


class BrakeForce(Brakes):
    """Brakes that are stated by their force."""

    force_kN: Force = Field(description="whole force of each vehicle [kN]")

    def whole_kN(self, mass_t: float) -> float:
        """Whole force of a vehicle, before the bound by adhesion [kN]."""
        return self.force_kN


class BrakeDeceleration(Brakes):
    """Brakes that are stated by the deceleration that they give."""

    deceleration_m_per_s2: Annotated[
        float,
        Field(ge=0, le=10, allow_inf_nan=False),
        Above("decelerations are in m/s2; divide by 3.6 if it is in km/h per second"),
    ] = Field(description="deceleration of each vehicle by its whole brakes [m/s2]")

    def whole_kN(self, mass_t: float) -> float:
        """Whole force of a vehicle, before the bound by adhesion [kN]."""
        return self.deceleration_m_per_s2 * mass_t


BrakesSpec = Annotated[BrakeForce | BrakeDeceleration, Either()]
CouplerRef = Annotated[
    str | Annotated[list[str], Field(min_length=2, max_length=2)],
    Either(said="the name of a device, or those of two in series"),
]


Drawing = Literal["passenger", "regional", "coach", "wagon", "locomotive"]


class VehicleSpec(Part):
    """One vehicle of a train; the train states for all vehicles what this one leaves out."""

    name: Label = Field(description="type of vehicle; --set finds it by this name")
    mass_t: Mass | None = None
    length_m: Length | None = None
    coupler: CouplerRef | None = Field(
        default=None,
        description="device between this vehicle and the next one behind it, or one on each of the two in series: that "
        "of this vehicle, that of the next",
    )
    front: str | None = Field(
        default=None, description="device at the end of this vehicle that faces the front of the train"
    )
    rear: str | None = Field(
        default=None, description="device at its other end, in series with that of the next vehicle"
    )
    load: Load | None = Field(default=None, description="passengers and freight; the train states what is left out")
    brakes: BrakesSpec | None = Field(default=None, description="brakes, in place of those of the train")
    rail_friction: Friction | None = Field(
        default=None, description="Coulomb coefficient between wheel and rail, in place of that of the train"
    )
    body: Body | None = Field(default=None, description="car body, in place of that of the train; rigid for one mass")
    type: str | None = Field(
        default=None, description="one of vehicle_types, for the vertical plane, in place of that of the train"
    )
    drawing: Drawing | None = Field(default=None, description="what pictures show it as, in place of that of the train")


class VehiclesFile(TableFile):
    """Vehicles in a CSV file or a workbook beside the scenario, a row each.

    Columns are name and any of mass_t, length_m, coupler, front, rear, type, drawing, rail_friction, and of
    the load seats, share, kg, freight_t; others are refused, and an empty cell states nothing.
    """

    columns: ClassVar = ("name",)
    texts: ClassVar = ("name", "coupler", "front", "rear", "type", "drawing")
    others: ClassVar = (*texts[1:], "mass_t", "length_m", "rail_friction", *Load.model_fields)
    curve: ClassVar = False
    row: ClassVar = "vehicle"
    most: ClassVar = MAX_VEHICLES

    @classmethod
    def values_of(cls, table: Table) -> tuple[Any, dict[tuple[str | int, ...], int | None]]:
        """The rows as a list of vehicles.

        Raises:
            InputError: if there is a column that is not known, or a cell is not what its column needs.
        """
        load = tuple(Load.model_fields)
        known = (*cls.columns, *cls.others)
        for head, column in table.columns.items():
            if head not in known:
                raise InputError(f"has a column {ascii(head)[:_SHOWN]}, which no vehicle has{close_match(head, known)}")
            if head not in cls.texts and (row := first_of_no_number(column)) is not None:
                raise table.refusal(row, head, "must be a number, or empty")
            table.column(head)
        found = []
        for n in range(len(table.lines)):
            cells = {head: column[n] for head, column in table.columns.items()}
            stated = {key: cell for key, cell in cells.items() if not (cell == "" or cell != cell)}
            if str(stated.get("name", "")).strip(" :").lower() in _SUMS:
                raise table.refusal(n, "name", "is a sum or a mean, not a vehicle: leave the row out, or state a range")
            loaded = {key: stated.pop(key) for key in load if key in stated}
            found.append(stated | ({"load": loaded} if loaded else {}))
        return found, {(n,): n for n in range(len(found))}


class Car(NamedTuple):
    """A vehicle with the values of its train where it has none; None where neither has one."""

    name: str
    mass_t: float | None  # with its load
    length_m: float
    load_t: float = 0.0
    rail_friction: float | None = None
    brakes: BrakeForce | BrakeDeceleration | None = None
    body: BodySpec | None = None
    type: str | None = None  # of vehicle_types
    turned: bool = False  # whether its rear end is in front
    drawing: str = "passenger"


class TrainSpec(Part):
    """A train, with its vehicles from the front end; a wagon is a train of one vehicle."""

    vehicles: Annotated[
        Annotated[int, Field(ge=1, le=MAX_VEHICLES), WHOLE]
        | Annotated[list[VehicleSpec], Field(min_length=1, max_length=MAX_VEHICLES)]
        | VehiclesFile,
        Either(said="a list of vehicles, how many, or a file"),
    ] = Field(description="the vehicles from the front end, or only how many")
    mass_t: Mass | None = Field(default=None, description="mass of vehicles that state none of their own [t]")
    length_m: Length = Field(default=20.0, description="length of vehicles that state none of their own [m]")
    coupler: CouplerRef | None = Field(
        default=None, description="device between vehicles that state none of their own, or two in series"
    )
    ends: str | None = Field(
        default=None, description="in place of coupler: device at each end between vehicles that states none of its own"
    )
    front: str | None = Field(default=None, description="device at the front end of the train")
    rear: str | None = Field(default=None, description="device at the rear end of the train")
    load: Load | None = Field(default=None, description="load of each vehicle that states none of its own")
    brakes: BrakesSpec | None = Field(default=None, description="brakes of each vehicle that states none of its own")
    rail_friction: Friction | None = Field(
        default=None, description="Coulomb coefficient between wheel and rail, in place of that of the collision"
    )
    body: Body | None = Field(
        default=None, description="car body of each vehicle that states none of its own; one mass if left out"
    )
    type: str | None = Field(
        default=None, description="one of vehicle_types, for the vertical plane, of each vehicle that states none"
    )
    drawing: Drawing = Field(default="passenger", description="what pictures show vehicles as that state none")

    def each(self) -> list[VehicleSpec]:
        """The vehicles from the front end as they are stated, those of a number by their position."""
        if isinstance(self.vehicles, int):
            return [VehicleSpec(name=str(i + 1)) for i in range(self.vehicles)]
        return self.vehicles if isinstance(self.vehicles, list) else []  # a file is read when the scenario is loaded

    def load_of(self, vehicle: VehicleSpec) -> Load:
        """The load of a vehicle, with what the train states for all where it leaves something out."""
        if vehicle.load is None or self.load is None:
            return vehicle.load or self.load or _NO_LOAD
        return self.load.model_copy(update={key: value for key, value in vehicle.load if value is not None})

    def load_t(self, vehicle: VehicleSpec) -> float:
        """Mass of the load of a vehicle [t]; 0 if there is none."""
        load = self.load_of(vehicle)
        passengers = (load.seats or 0.0) * (load.share or 0.0) * (load.kg or 0.0) * KG
        return passengers + load.freight_t if load.freight_t else passengers

    def body_of(self, vehicle: VehicleSpec) -> BodySpec | None:
        """The body of a vehicle; None where it is rigid."""
        body = vehicle.body or self.body
        return None if isinstance(body, str) else body

    def cars(self, end: End = "front") -> list[Car]:
        """Every vehicle from an end, with the values that the train states for all; turned round from the rear."""
        cars = [self._car(vehicle) for vehicle in self.each()]
        if end == "front":
            return cars
        return [car._replace(body=car.body.turned() if car.body else None, turned=True) for car in cars[::-1]]

    def joints(self, end: End = "front") -> list[tuple[str, ...]]:
        """Devices from an end: at this end, then between each vehicle and the next; none where none is stated.

        One stands for a whole interface; two are in series, that of the vehicle nearer to this end first.
        """
        cars = self.each()
        inner = [self.between(*pair) for pair in pairwise(cars)]
        joints = [_names(joint) for joint in (self.front or cars[0].front, *inner, self.rear or cars[-1].rear)]
        return joints[:-1] if end == "front" else [joint[::-1] for joint in joints[:0:-1]]

    def between(self, before: VehicleSpec, behind: VehicleSpec) -> CouplerRef | None:
        """Between two vehicles: what they state before what the train states; None if an end has no device."""
        if before.coupler:
            return before.coupler
        if not (before.rear or behind.front or self.ends):
            return self.coupler
        rear, front = before.rear or self.ends, behind.front or self.ends
        return [rear, front] if rear and front else None

    def _car(self, v: VehicleSpec) -> Car:
        load_t = self.load_t(v)
        mass = self.mass_t if v.mass_t is None else v.mass_t
        return Car(
            v.name,
            None if mass is None else mass + load_t,
            self.length_m if v.length_m is None else v.length_m,
            load_t,
            self.rail_friction if v.rail_friction is None else v.rail_friction,
            v.brakes or self.brakes,
            self.body_of(v),
            v.type or self.type,
            drawing=v.drawing or self.drawing,
        )


def _names(joint: CouplerRef | None) -> tuple[str, ...]:
    return (joint,) if isinstance(joint, str) else tuple(joint or ())


class ObstacleSpec(Part):
    """What a train runs into and is no train: free, as a lorry on the track, or fixed, as a buffer stop."""

    fixed: bool = Field(default=False, description="whether it is a device on a wall; a free one slides on the ground")
    mass_t: (
        Annotated[
            float,
            Field(ge=LEAST_MASS, le=1000, allow_inf_nan=False),
            Above("masses are in t; divide by 1000 if it is in kg"),
        ]
        | None
    ) = Field(default=None, description="mass of a free obstacle [t]")
    length_m: Length = Field(default=6.0, description="length [m]")
    front: str = Field(description="device at the side that is hit")
    rail_friction: Friction | None = Field(
        default=None,
        description="Coulomb coefficient between a free obstacle and the ground, in place of that of the collision",
    )
    drawing: Literal["lorry", "block", "buffer_stop"] | None = Field(
        default=None, description="what pictures show it as; a free one is a lorry, a fixed one a buffer stop"
    )

    @property
    def drawn(self) -> str:
        """What pictures show it as."""
        return self.drawing or ("buffer_stop" if self.fixed else "lorry")
