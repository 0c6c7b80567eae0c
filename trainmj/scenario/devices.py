"""The kinds of device of a scenario file, one class each; a device that states no kind is crushed.

A further kind is one more class in :data:`DeviceSpec`, and its rules in :mod:`trainmj.scenario.rules_of_devices`.
"""

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from trainmj.files.parts import Above, Either, Part
from trainmj.scenario.curves import CurveRef, Metering, MeteringFile
from trainmj.scenario.lines import LineSpec
from trainmj.scenario.ranges import Damping, Force, Key, Orifice, Stiffness, Stroke

DEVICE = "device"  # the name of the only stage of a device with one curve
COLLAPSE_FORCE = 2000.0  # of a car body that states none [kN]; Liu et al. 2022
MAX_STAGES = 20
MAX_RATES = 20

Place = tuple[str | int, ...]
"""Keys and positions below a device."""


# beyond its end


class CarBody(Part):
    """The car body behind a device: the force climbs to the collapse force, then holds."""

    kind: Literal["car_body"]
    collapse_force_kN: Annotated[Force, Field(gt=0)] = Field(
        default=COLLAPSE_FORCE, description="force at which the car body collapses [kN]; 2000 kN as in Liu et al. 2022"
    )
    stiffness_kN_per_mm: Stiffness | None = Field(
        default=None, description="along which the force climbs [kN/mm]; that of the device if left out"
    )


class Stop(Part):
    """A stop behind a device: the force climbs for ever."""

    kind: Literal["stop"]
    stiffness_kN_per_mm: Stiffness | None = Field(
        default=None, description="along which the force climbs [kN/mm]; that of the device if left out"
    )


Beyond = Annotated[
    Literal["car_body", "stop", "hold"] | CarBody | Stop,
    Either(by="kind", said="'car_body', 'stop' or 'hold', or a group with kind"),
]


class End(NamedTuple):
    """What lies beyond the end of a device, all defaults in place."""

    kind: Literal["car_body", "stop", "hold"]
    collapse_force_kN: float | None  # of a car body
    stiffness_kN_per_mm: float | None  # of a car body or stop; None also where the device has none of its own


class Pull(Part):
    """The draw gear: the force when the two vehicles are drawn apart."""

    curve: CurveRef | None = Field(
        default=None,
        description="force over stroke from the end of the slack; linear along the stiffness if left out",
    )
    stiffness_kN_per_mm: Stiffness = Field(description="unloading stiffness, or that of a linear draw gear [kN/mm]")
    damping_kN_s_per_m: Damping = Field(default=0.0, description="dashpot on the elastic branch [kN s/m]")
    slack_mm: Stroke = Field(default=0.0, description="travel apart without force [mm]")
    breaking_force_kN: Annotated[Force, Field(gt=0)] | None = Field(
        default=None, description="force at which it breaks for good [kN]; never if left out"
    )


class AnyDevice(Part):
    """What devices of all kinds have."""

    kind: str
    beyond: Beyond | None = Field(
        default=None,
        description="what follows at its end: the car body, a stop, or hold, the last force; if left out, the last "
        "force is held, and results from then on are not valid",
    )
    pull: Pull | None = Field(
        default=None, description="draw gear between vehicles of one train; without it, it only pushes"
    )

    @property
    def law(self) -> str:
        """Name of its law."""
        return self.kind

    @property
    def own_stiffness_kN_per_mm(self) -> float | None:
        """The stiffness of what lies beyond its end, if that states none [kN/mm]."""
        return None

    def own_curves(self) -> Iterator[tuple[Place, CurveRef]]:
        """The curves of its kind, each with its place below the device; none by default."""
        return iter(())

    def curves(self) -> Iterator[tuple[Place, CurveRef]]:
        """Every curve, each with its place below the device."""
        yield from self.own_curves()
        if self.pull is not None and self.pull.curve is not None:
            yield ("pull", "curve"), self.pull.curve

    @abstractmethod
    def lines(self) -> Iterator[tuple[Place, LineSpec | None]]:
        """The line of each path through the device, with the place below it that states the line."""

    def end(self) -> End | None:
        """What lies beyond its end; None if nothing is stated."""
        match self.beyond:
            case None:
                return None
            case "hold":
                return End("hold", None, None)
            case "car_body":
                beyond: CarBody | Stop = CarBody(kind="car_body")
            case "stop":
                beyond = Stop(kind="stop")
            case CarBody() | Stop():
                beyond = self.beyond
        stiffness = beyond.stiffness_kN_per_mm or self.own_stiffness_kN_per_mm
        return End(beyond.kind, beyond.collapse_force_kN if isinstance(beyond, CarBody) else None, stiffness)


# crush


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
    line: LineSpec | None = Field(
        default=None,
        description="along which it acts in the vertical plane; stages with no bolts in between act along one",
    )


class CowperSymonds(Part):
    """The crush force grows with the rate: times 1 + (rate/C)^(1/P), linear below 0.01 m/s."""

    C_m_per_s: Annotated[
        float,
        Field(ge=1e-3, le=1e5, allow_inf_nan=False),
        Above("C is in m/s: the constant of the material in 1/s times the length of a fold in m"),
    ] = Field(description="rate at which the force has doubled: strain rate constant times fold length [m/s]")
    P: Annotated[float, Field(ge=0.1, le=100, allow_inf_nan=False)] = Field(description="exponent of the material")


class RateCurve(Part):
    """A crush curve measured at a speed."""

    speed_m_per_s: Annotated[
        float,
        Field(gt=0, le=100, allow_inf_nan=False),
        Above("speeds of rate curves are in m/s; divide by 3.6 if it is in km/h"),
    ] = Field(description="rate of compression [m/s]")
    curve: CurveRef = Field(description="crush curve at this rate, over the same stroke as that at rest")


class RateCurves(Part):
    """Crush curves at several rates, linear in between, held above the fastest; that of the device is at rest."""

    curves: Annotated[list[RateCurve], Field(min_length=1, max_length=MAX_RATES)] = Field(
        description="curves by growing speed"
    )


class CrushDevice(AnyDevice):
    """How a device that was crushed unloads and is loaded again."""

    kind: Literal["crush"] = "crush"
    stiffness_kN_per_mm: Stiffness = Field(description="unloading stiffness [kN/mm]")
    damping_kN_s_per_m: Damping = Field(default=0.0, description="dashpot on the elastic branch [kN s/m]")
    rate: Annotated[CowperSymonds | RateCurves, Either()] | None = Field(
        default=None, description="how the crush force grows with the rate of compression"
    )

    @property
    def law(self) -> str:
        """Crush, or with a rate the one of that name."""
        return self.kind if self.rate is None else "rate"

    @property
    def own_stiffness_kN_per_mm(self) -> float:
        """The unloading stiffness [kN/mm]."""
        return self.stiffness_kN_per_mm

    @abstractmethod
    def all_stages(self) -> dict[str, StageSpec]:
        """The stages by name, in their order."""

    @abstractmethod
    def place_of(self, stage: str) -> Place:
        """The place of a stage below the device."""

    def runs(self) -> list[list[str]]:
        """Names of the stages that act along one line, up to a shear-off each."""
        stages = self.all_stages()
        runs: list[list[str]] = [[]]
        for name, stage in stages.items():
            runs[-1].append(name)
            if stage.shear_off is not None:
                runs.append([])
        return [run for run in runs if run]

    def lines(self) -> Iterator[tuple[Place, LineSpec | None]]:
        """Those of the stages that come first on each path."""
        stages = self.all_stages()
        for first, *_ in self.runs():
            yield self.place_of(first), stages[first].line

    def rate_curves(self) -> list[RateCurve]:
        """The curves at several rates; empty if there are none."""
        return self.rate.curves if isinstance(self.rate, RateCurves) else []

    def own_curves(self) -> Iterator[tuple[Place, CurveRef]]:
        """Those of the stages, then those at several rates."""
        for name, stage in self.all_stages().items():
            yield (*self.place_of(name), "curve"), stage.curve
        for n, at_rate in enumerate(self.rate_curves()):
            yield ("rate", "curves", n, "curve"), at_rate.curve


class CurveDevice(CrushDevice, StageSpec):
    """A device of one curve that is crushed."""

    def all_stages(self) -> dict[str, StageSpec]:
        """The device as its own single stage."""
        return {DEVICE: self}

    def place_of(self, stage: str) -> Place:
        """The device itself."""
        return ()


class StagedDevice(CrushDevice):
    """A device of stages that are crushed one after the other."""

    stages: Annotated[dict[Key, StageSpec], Field(min_length=1, max_length=MAX_STAGES)] = Field(
        description="stages by name, in the order in which they act"
    )

    def all_stages(self) -> dict[str, StageSpec]:
        """The stages by name, in their order."""
        return self.stages

    def place_of(self, stage: str) -> Place:
        """Where the stage is stated."""
        return ("stages", stage)


# what recovers


class RecoveringDevice(AnyDevice):
    """A device that comes back to its length."""

    empty_stroke_mm: Stroke = Field(default=0.0, description="travel without force before it engages [mm]")
    stroke_limit_mm: Annotated[Stroke, Field(gt=0)] | None = Field(
        default=None, description="largest stroke the design allows, from where it engages [mm]"
    )
    line: LineSpec | None = Field(default=None, description="along which it acts in the vertical plane")

    def lines(self) -> Iterator[tuple[Place, LineSpec | None]]:
        """Its only one."""
        yield (), self.line


class HysteresisDevice(RecoveringDevice):
    """A friction draft gear, or rubber: it follows one curve inwards and a lower one outwards."""

    kind: Literal["hysteresis"]
    loading: CurveRef = Field(description="force inwards: a curve as of a crush device")
    unloading: CurveRef = Field(description="force outwards, never above that inwards: a curve as of a crush device")
    transition_stiffness_kN_per_mm: Stiffness = Field(
        description="between the two curves, steeper than both everywhere [kN/mm]"
    )

    @property
    def own_stiffness_kN_per_mm(self) -> float:
        """The transition stiffness [kN/mm]."""
        return self.transition_stiffness_kN_per_mm

    def own_curves(self) -> Iterator[tuple[Place, CurveRef]]:
        """Inwards, then outwards."""
        yield ("loading",), self.loading
        yield ("unloading",), self.unloading


class Hydraulic(RecoveringDevice):
    """Oil through an orifice."""

    beyond: Beyond | None = Field(
        default=None,
        description="a stop or the car body, with a stiffness of its own, at the end of the stroke; compulsory",
    )
    stroke_mm: Annotated[Stroke, Field(gt=0)] = Field(description="stroke of the plunger [mm]")
    orifice_kN_s2_per_m2: Orifice | None = Field(
        default=None, description="force over the square of the speed, the same at each stroke [kN s2/m2]"
    )
    metering: Annotated[Metering | MeteringFile, Either()] | None = Field(
        default=None, description="in its place: an orifice that changes with the stroke"
    )

    def orifice_points(self) -> tuple[list[float], list[float]]:
        """Strokes [mm] and orifice constants there [kN s2/m2]; a constant one at both ends of the stroke."""
        if isinstance(self.metering, Metering):  # a file is read when the scenario is loaded
            return self.metering.stroke_mm, self.metering.orifice_kN_s2_per_m2
        return [0.0, self.stroke_mm], [self.orifice_kN_s2_per_m2 or 0.0] * 2


class HydraulicDevice(Hydraulic):
    """Oil through an orifice: the force grows with the square of the speed inwards, and is none outwards."""

    kind: Literal["hydraulic"]
    preload_kN: Force = Field(default=0.0, description="force inwards that does not depend on the speed [kN]")
    preload_stiffness_kN_per_mm: Stiffness | None = Field(
        default=None, description="along which the preload is reached [kN/mm]; compulsory with a preload"
    )


class Gas(Part):
    """The gas spring of a device: force_kN (1 - stroke/length)^-exponent, reached along the preload stiffness."""

    force_kN: Annotated[Force, Field(gt=0)] = Field(description="force at full length, the preload [kN]")
    length_mm: Annotated[Stroke, Field(gt=0)] = Field(
        description="length of the gas column at full length, more than the stroke [mm]"
    )
    exponent: Annotated[float, Field(ge=1, le=3, allow_inf_nan=False)] = Field(
        description="polytropic exponent: 1 if slow, 1.4 for air or nitrogen if quick"
    )
    preload_stiffness_kN_per_mm: Stiffness = Field(description="along which the preload is reached [kN/mm]")

    def force_at_kN(self, stroke_mm: float) -> float:
        """Force at a stroke, without the rise to the preload [kN]."""
        return self.force_kN * math.pow(1.0 - stroke_mm / self.length_mm, -self.exponent)


class GasHydraulicDevice(Hydraulic):
    """Oil through an orifice, and a gas spring that pushes the plunger back."""

    kind: Literal["gas_hydraulic"]

    @property
    def law(self) -> str:
        """That of a hydraulic device, which may have a gas spring."""
        return "hydraulic"

    gas: Gas = Field(description="the gas spring")
    rebound_orifice_kN_s2_per_m2: Orifice = Field(
        description="outwards this times the square of the speed is taken from the force of the gas [kN s2/m2]; with 0 "
        "the plunger follows at once"
    )


DeviceSpec = Annotated[
    CurveDevice | StagedDevice | HysteresisDevice | HydraulicDevice | GasHydraulicDevice, Either(by="kind")
]
