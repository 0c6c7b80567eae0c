"""The parts of a scenario file: curves, devices, trains, the collision, and how it is computed.

Each part checks its own keys, types and ranges; what concerns several parts is in :mod:`trainmj.scenario.rules`.
Values stay in the units of their names; :mod:`trainmj.collision.chain` turns them into SI arrays.
"""

from functools import cached_property
from typing import Annotated, Literal

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from trainmj.files.cover import Cover
from trainmj.files.parts import Above, Below, Either, Notes, Part, Positive, Title
from trainmj.files.provenance import Sources
from trainmj.scenario.as_built import AsBuilt, Built, built
from trainmj.scenario.curves import Curve, CurveFile, CurveRef, listed
from trainmj.scenario.devices import DeviceSpec
from trainmj.scenario.lines import Ties
from trainmj.scenario.ranges import Flights, Friction, Gap, Key, Response, SideOrVehicle, Speed, Step
from trainmj.scenario.running_gear import VehicleType
from trainmj.scenario.tolerances import Tolerances
from trainmj.scenario.trains import RIGID_WALL, End, ObstacleSpec, TrainSpec

MAX_NAMES = 1000
_OFFSETS, _PITCHES = "offsets are in mm", "pitches are in mrad"
Offset = Annotated[float, Field(ge=-500, le=500, allow_inf_nan=False), Above(_OFFSETS), Below(_OFFSETS)]
Pitch = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False), Above(_PITCHES), Below(_PITCHES)]


def _each_once(names: list[str]) -> list[str]:
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise PydanticCustomError("twice", "states {twice} more than once", {"twice": twice})
    return names


class Collision(Part):
    """Who runs into whom. The train moves along +x."""

    train: str = Field(description="the train that runs into its partner")
    speed_km_h: Speed
    partner: str = Field(
        description=f"another train, the same one, an obstacle, {RIGID_WALL}, or a partner file by its name: "
        "NAME.partner.yaml beside the scenario, or one that ships"
    )
    partner_speed_km_h: Speed = 0.0
    train_end: End = Field(default="front", description="the end of the train that leads")
    partner_end: End = Field(default="front", description="the end of the partner that is struck")
    gap_mm: Gap = Field(default=0.0, description="distance between the two sides at time 0 [mm]")
    rail_friction: Friction = Field(
        default=0.0,
        description="Coulomb coefficient between wheel and rail, of every vehicle whose train states no other",
    )
    offset_mm: dict[SideOrVehicle, Offset] = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="by how much a side, M or S, or a single vehicle, such as M1, stands higher than designed, in the "
        "vertical plane [mm]: wheel wear, shims; a vehicle goes before its side",
    )
    pitch_mrad: dict[SideOrVehicle, Pitch] = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="pitch with which a side or a vehicle stands, likewise [mrad]; positive with the end up that faces "
        "the impact",
    )
    grade_per_mille: Annotated[
        float,
        Field(ge=-200, le=200, allow_inf_nan=False),
        Above("grades are in per mille; multiply by 10 if it is in %, and no track is steeper than 200 per mille"),
    ] = Field(default=0.0, description="grade of the track [per mille], positive uphill along +x")


class Occupants(Part):
    """Occupants who fly freely in their vehicle until they meet what is a distance ahead of them, or behind them."""

    free_flight_mm: Flights = Field(
        default_factory=list,
        description="distances [mm], in whole mm; for each of them there are secondary impact velocities",
    )


class Simulation(Part):
    """How it is computed. The default step follows from a convergence study; see the documentation."""

    step_ms: Step = Field(default=0.1, description="time step [ms]; one that is too large for the devices is refused")
    record_every_ms: Annotated[float, Field(ge=1e-4, le=100, allow_inf_nan=False)] = Field(
        default=1.0, description="time between samples of the histories [ms], a whole multiple of step_ms"
    )
    averaging_ms: Annotated[float, Field(gt=0, le=60_000, allow_inf_nan=False)] | None = Field(
        default=None,
        description="length of the consecutive windows, from time 0 on, over which averaged_device_acceleration_g and "
        "TAMA_averaged_g average the device forces [ms], a whole multiple of step_ms; by default neither is there",
    )
    contact_threshold_kN: Annotated[
        float, Field(gt=0, le=1000, allow_inf_nan=False), Above("it is in kN; divide by 1000 if it is in N")
    ] = Field(
        default=1.0,
        description="net force of its devices above which a vehicle is in contact, as for mean_deceleration_g [kN]",
    )
    time_limit_s: Annotated[
        float, Field(gt=0, le=60, allow_inf_nan=False), Above("it is in s; divide by 1000 if it is in ms")
    ] = Field(default=3.0, description="when a collision that is not over is cut off [s]")
    integrator: Literal["euler", "events", "implicitfast", "implicit"] = Field(
        default="euler",
        description="how steps are made; events makes those of euler and follows each device through what happens to "
        "it within a step, such as a bend of its curve, so that strokes are as exact at a step several times as long; "
        "along the track only; the others are MuJoCo's; each evaluates the forces once a step, as devices need",
    )

    @property
    def steps_per_record(self) -> int:
        """Steps from one recorded sample to the next."""
        return max(1, round(self.record_every_ms / self.step_ms))

    @property
    def steps_per_window(self) -> int:
        """Steps in a window over which device forces are averaged; 0 for none."""
        return 0 if self.averaging_ms is None else max(1, round(self.averaging_ms / self.step_ms))


Paths = Annotated[list[str], Field(min_length=1)]


class Parts(Part, title="scenario file"):
    """All parts of a scenario together."""

    title: Title = Field(default="", description="one line that heads every output")
    notes: Notes = Field(default="", description="such as where the numbers come from")
    report: Cover = Field(
        default=Cover(), description="what heads its reports: project, client, author, revision, date"
    )
    changed: Annotated[list[str], Field(max_length=MAX_NAMES)] = Field(
        default_factory=list,
        description="values that were changed after the title was written, by parameter or path; every output shows "
        "them beside the title; trainmj states it",
    )
    sources: Sources = Field(
        default_factory=dict,
        description="where values come from: by the path of a value, or of a group for all that is in it",
    )
    parameters: dict[Key, Annotated[str | Paths, Either(said="a path, or a list of paths")]] = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="short names for values: a path, or several that change together",
    )
    plane: Literal["line", "vertical"] = Field(
        default="line",
        description="whether vehicles move along the track only, or in the vertical plane, on their running gear",
    )
    ties: Ties = Field(
        default="stated",
        description="what holds ends together vertically, in the vertical plane: nothing; what lines state; or ties of "
        "any strength and swing stops without free angle",
    )
    bracket: Annotated[
        list[Ties],
        Field(min_length=2, max_length=3, json_schema_extra={"uniqueItems": True}),
        AfterValidator(_each_once),
    ] = Field(
        default_factory=list,
        validate_default=False,
        description="ties to compute one beside the other: what is not known lies in between",
    )
    curves: dict[Key, Annotated[Curve | CurveFile, Either()]] = Field(
        default_factory=dict, max_length=MAX_NAMES, description="curves that several devices share, by name"
    )
    devices: dict[Key, DeviceSpec] = Field(max_length=MAX_NAMES, description="couplers, absorbers, buffers, by name")
    trains: dict[Key, TrainSpec] = Field(max_length=MAX_NAMES, description="trains and wagons, by name")
    vehicle_types: dict[Key, VehicleType] = Field(
        default_factory=dict, max_length=MAX_NAMES, description="what carries vehicles in the vertical plane, by name"
    )
    obstacles: dict[Key, ObstacleSpec] = Field(
        default_factory=dict, max_length=MAX_NAMES, description="what is hit and is no train, by name"
    )
    collision: Collision = Field(description="who runs into whom")
    as_built: AsBuilt = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="single vehicles and devices that differ from what is stated of their kind: by their place in the "
        "collision (M1, M1-M2, S1-M1 partner), new values by the paths below them",
    )
    tolerances: Tolerances = Field(
        default_factory=dict,
        description="what scatters from train to train, for trainmj reliability and robust studies, by a name each",
    )
    occupants: Occupants = Field(default=Occupants(), description="how far occupants fly freely in their vehicle")
    simulation: Simulation = Field(default=Simulation(), description="how it is computed")
    limits: dict[Response, Positive] = Field(
        default_factory=dict,
        max_length=MAX_NAMES,
        description="largest magnitudes allowed for the train under test, the moving one: of a quantity of its "
        "vehicles or interfaces, or of one response by the name of its column",
    )

    @cached_property
    def built(self) -> Built:
        """The vehicles and devices under ``as_built``.

        Raises:
            InputError: if nothing is at a place or path, or a value breaks a rule of its own.
        """
        return built(self)

    @property
    def states_the_plane(self) -> bool:
        """Whether something is stated that has an effect in the vertical plane only."""
        c = self.collision
        lines = (line for device in self.devices.values() for _, line in device.lines())
        return bool(
            self.vehicle_types or self.bracket or self.ties != "stated" or c.offset_mm or c.pitch_mrad or any(lines)
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
