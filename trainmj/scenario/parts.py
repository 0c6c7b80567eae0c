"""The parts of a scenario file: curves, devices, trains, the collision, and how it is computed.

Each part checks its own keys, types and ranges; what concerns several parts is in :mod:`trainmj.scenario.rules`.
Values stay in the units of their names; :mod:`trainmj.collision.chain` turns them into SI arrays.
"""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from trainmj.files.parts import WHOLE, Above, Either, Notes, Part, Positive, Spelt, Title

RIGID_WALL = "rigid_wall"
DEVICE = "device"  # the name of the only stage of a device with one curve
MAX_VEHICLES = 400
MAX_POINTS = 2000
MAX_DEVICE_POINTS = 4000
MAX_NAMES = 1000
MAX_STAGES = 20

# Beyond every vehicle and device, but below almost all that is stated in a wrong unit. Car bodies are proved to 2000 kN
# and whole ends crush at some 20 000 kN. A solid cube of steel with edges of 240 mm has 50 000 kN/mm; on half of that a
# dashpot of 100 000 kN s/m damps 100 t critically. A crush zone of 10 m is half a car.
Force = Annotated[
    float,
    Field(ge=0, le=50_000, allow_inf_nan=False),
    Above("forces are in kN; divide by 1000 if it is in N"),
]
Stiffness = Annotated[
    float,
    Field(ge=1e-6, le=50_000, allow_inf_nan=False),
    Above("stiffnesses are in kN/mm; divide by 1000 if it is in N/mm"),
]
Damping = Annotated[
    float,
    Field(ge=0, le=100_000, allow_inf_nan=False),
    Above("dashpots are in kN s/m; divide by 1000 if it is in N s/m"),
]
Stroke = Annotated[
    float,
    Field(ge=0, le=10_000, allow_inf_nan=False),
    Above("strokes are in mm; no device is longer than 10 m"),
]
Gap = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False), Above("gaps are in mm")]
Mass = Annotated[
    float,
    Field(ge=1, le=200, allow_inf_nan=False, description="mass of a vehicle [t]"),
    Above("masses are in t; divide by 1000 if it is in kg"),
]
Length = Annotated[
    float,
    Field(ge=0.5, le=60, allow_inf_nan=False, description="length of a vehicle [m]"),
    Above("lengths are in m; divide by 1000 if it is in mm"),
]
Step = Annotated[float, Field(ge=1e-4, le=2, allow_inf_nan=False)]
Speed = Annotated[float, Field(ge=-200, le=200, allow_inf_nan=False, description="speed along +x [km/h]")]
Key = Annotated[
    str,
    Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=60),
    Spelt("must be a letter or _, then letters, digits and _"),
]
Response = Annotated[
    str,
    Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=120),
    Spelt("must be a letter, then letters, digits and _"),
]
Label = Annotated[
    str,
    Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+/ -]*$", max_length=40),
    Spelt("must be a letter or digit, then letters, digits, spaces and . _ + / -"),
]


class Curve(Part):
    """Points of a crush curve."""

    stroke_mm: Annotated[list[Stroke], Field(min_length=1, max_length=MAX_POINTS)] = Field(
        description="strokes [mm], always growing"
    )
    force_kN: Annotated[list[Force], Field(min_length=1, max_length=MAX_POINTS)] = Field(
        description="crush force at each stroke [kN]"
    )


class CurveFile(Part):
    """A crush curve in a CSV file beside the scenario, with columns stroke_mm and force_kN."""

    file: str = Field(description="name of the CSV file")


OneCurve = Annotated[str | Curve | CurveFile, Either(said="the name of a curve, or its points")]
CurveRef = Annotated[
    str | Curve | CurveFile | Annotated[list[OneCurve], Field(min_length=1, max_length=100)],
    Either(said="the name of a curve, its points, or a list of these"),
]


def listed(ref: CurveRef) -> list[tuple[tuple[int, ...], str | Curve | CurveFile]]:
    """The parts of a curve, each with its position below it."""
    return [((n,), part) for n, part in enumerate(ref)] if isinstance(ref, list) else [((), ref)]


class ShearOff(Part):
    """Bolts that fail at the end of a curve: the force rises to force_kN, then drops to zero."""

    force_kN: Force = Field(description="force at which the bolts shear [kN]")
    ramp_mm: Annotated[Stroke, Field(ge=1e-3)] = Field(
        default=0.25, description="stroke of the rise, and again of the drop [mm]"
    )


class StageSpec(Part):
    """One part of a device, from the stroke at which it engages."""

    curve: CurveRef = Field(
        description="the name of a curve, points or a CSV file, or a list of these that is read as one curve"
    )
    empty_stroke_mm: Stroke = Field(default=0.0, description="travel without force before it engages [mm]")
    shear_off: ShearOff | None = Field(default=None, description="bolts that fail at the end of the curve")
    stroke_limit_mm: Annotated[Stroke, Field(gt=0)] | None = Field(
        default=None, description="largest stroke the design allows [mm]"
    )


class Unloading(Part):
    """How a device that was crushed unloads and is loaded again."""

    stiffness_kN_per_mm: Stiffness = Field(description="unloading stiffness [kN/mm]")
    damping_kN_s_per_m: Damping = Field(default=0.0, description="dashpot on the elastic branch [kN s/m]")


class CurveDevice(Unloading, StageSpec):
    """A device of one curve."""

    def all_stages(self) -> dict[str, StageSpec]:
        """The device as its own single stage."""
        return {DEVICE: self}


class StagedDevice(Unloading):
    """A device of stages that act one after the other."""

    stages: Annotated[dict[Key, StageSpec], Field(min_length=1, max_length=MAX_STAGES)] = Field(
        description="stages by name, in the order in which they act"
    )

    def all_stages(self) -> dict[str, StageSpec]:
        """The stages by name, in their order."""
        return self.stages


DeviceSpec = Annotated[CurveDevice | StagedDevice, Either()]


class VehicleSpec(Part):
    """One vehicle of a train; the train states for all vehicles what this one leaves out."""

    name: Label = Field(description="type of vehicle; --set finds it by this name")
    mass_t: Mass | None = None
    length_m: Length | None = None
    coupler: str | None = Field(default=None, description="device between this vehicle and the next one behind it")


class Car(NamedTuple):
    """A vehicle with the values of its train where it has none; None where neither has one."""

    name: str
    mass_t: float | None
    length_m: float
    coupler: str | None


class TrainSpec(Part):
    """A train, with its vehicles from the front end; a wagon is a train of one vehicle."""

    vehicles: Annotated[
        Annotated[int, Field(ge=1, le=MAX_VEHICLES), WHOLE]
        | Annotated[list[VehicleSpec], Field(min_length=1, max_length=MAX_VEHICLES)],
        Either(said="a list of vehicles, or how many"),
    ] = Field(description="the vehicles from the front end, or only how many")
    mass_t: Mass | None = Field(default=None, description="mass of vehicles that state none of their own [t]")
    length_m: Length = Field(default=20.0, description="length of vehicles that state none of their own [m]")
    coupler: str | None = Field(default=None, description="device between vehicles that state none of their own")
    front: str | None = Field(default=None, description="device at the front end")
    rear: str | None = Field(default=None, description="device at the rear end")

    def cars(self) -> list[Car]:
        """Every vehicle from the front end, with the values that the train states for all."""
        if isinstance(self.vehicles, int):
            return [Car(str(i + 1), self.mass_t, self.length_m, self.coupler) for i in range(self.vehicles)]
        return [
            Car(
                v.name,
                self.mass_t if v.mass_t is None else v.mass_t,
                self.length_m if v.length_m is None else v.length_m,
                self.coupler if v.coupler is None else v.coupler,
            )
            for v in self.vehicles
        ]


class Collision(Part):
    """Who runs into whom. The train moves along +x; its front end leads."""

    train: str = Field(description="the train that runs into its partner")
    speed_km_h: Speed
    partner: str = Field(description=f"another train, the same one, or {RIGID_WALL}")
    partner_speed_km_h: Speed = 0.0
    partner_end: Literal["front", "rear"] = Field(default="front", description="the end of the partner that is struck")
    gap_mm: Gap = Field(default=0.0, description="distance between the two sides at time 0 [mm]")
    rail_friction: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = Field(
        default=0.0, description="Coulomb coefficient between wheel and rail, for every vehicle"
    )


class Simulation(Part):
    """How it is computed. The default step follows from a convergence study; see the documentation."""

    step_ms: Step = Field(default=0.1, description="time step [ms]; one that is too large for the devices is refused")
    record_every_ms: Annotated[float, Field(ge=1e-4, le=100, allow_inf_nan=False)] = Field(
        default=1.0, description="time between samples of the histories [ms], a whole multiple of step_ms"
    )
    time_limit_s: Annotated[
        float, Field(gt=0, le=60, allow_inf_nan=False), Above("it is in s; divide by 1000 if it is in ms")
    ] = Field(default=3.0, description="when a collision that is not over is cut off [s]")
    integrator: Literal["euler", "implicitfast", "implicit"] = Field(
        default="euler", description="as MuJoCo names them; each evaluates the forces once a step, as devices need"
    )

    @property
    def steps_per_record(self) -> int:
        """Steps from one recorded sample to the next."""
        return max(1, round(self.record_every_ms / self.step_ms))


Paths = Annotated[list[str], Field(min_length=1)]


class Parts(Part, title="scenario file"):
    """All parts of a scenario together."""

    title: Title = Field(default="", description="one line that heads every output")
    notes: Notes = Field(default="", description="such as where the numbers come from")
    changed: Annotated[list[str], Field(max_length=MAX_NAMES)] = Field(
        default_factory=list,
        description="values that were changed after the title was written, by parameter or path; every output shows "
        "them beside the title; trainmj states it",
    )
    parameters: dict[Key, Annotated[str | Paths, Either(said="a path, or a list of paths")]] = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="short names for values: a path, or several that change together",
    )
    curves: dict[Key, Annotated[Curve | CurveFile, Either()]] = Field(
        default_factory=dict, max_length=MAX_NAMES, description="curves that several devices share, by name"
    )
    devices: dict[Key, DeviceSpec] = Field(max_length=MAX_NAMES, description="couplers, absorbers, buffers, by name")
    trains: dict[Key, TrainSpec] = Field(max_length=MAX_NAMES, description="trains and wagons, by name")
    collision: Collision = Field(description="who runs into whom")
    simulation: Simulation = Field(default=Simulation(), description="how it is computed")
    limits: dict[Response, Positive] = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="largest magnitudes allowed for the train under test, the moving one: of a quantity of its "
        "vehicles or interfaces, or of one response by the name of its column",
    )

    def curve_points(self, ref: CurveRef) -> tuple[list[float], list[float]]:
        """Strokes [mm] and forces [kN] of a curve, whichever way it is stated."""
        stroke: list[float] = []
        force: list[float] = []
        for _, part in listed(ref):
            curve = self.curves[part] if isinstance(part, str) else part
            if isinstance(curve, Curve):  # a file is read when the scenario is loaded
                stroke += curve.stroke_mm
                force += curve.force_kN
        return stroke, force
