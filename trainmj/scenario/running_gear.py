"""Types of vehicle in the vertical plane: the car body and the two bogies that carry it."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from trainmj.files.parts import Above, Below, Either, Part
from trainmj.files.source import Path, Problem
from trainmj.scenario.ranges import LEAST_MASS, Metres
from trainmj.units import KN_PER_MM, TONNE, G

_MOST_COMPRESSION = 1.0  # by the static load [m]
_STIFFNESSES = Above("stiffnesses are in kN/mm; divide by 1000 if it is in N/mm")
_DAMPERS = Above("dashpots are in kN s/m; divide by 1000 if it is in N s/m")
_T_M2 = Above("moments of inertia are in t m2; divide by 1000 if it is in kg m2")
_PartMass = Annotated[
    float,
    Field(gt=0, le=20, allow_inf_nan=False),
    Above("masses are in t; divide by 1000 if it is in kg"),
]
_Travel = Annotated[
    Literal["none"]
    | Annotated[
        float,
        Field(ge=1, le=500, allow_inf_nan=False),
        Above("travels to a stop are in mm"),
        Below("travels to a stop are in mm; multiply by 1000 if it is in m, or state none if there is no stop"),
    ],
    Either(said="a travel in mm, or none"),
]


class CarriedBody(Part):
    """The car body: what the vehicle weighs without frames and wheelsets."""

    cog_height_m: Annotated[Metres, Field(le=5)] = Field(
        description="height of the centre of gravity of the body above the rail [m]"
    )
    cog_x_m: Annotated[
        float, Field(ge=-20, le=20, allow_inf_nan=False), Above("it is in m; divide by 1000 if it is in mm")
    ] = Field(default=0.0, description="distance of that from the middle of the vehicle, towards its front end [m]")

    def inertia_t_m2(self, own_t: float) -> float:
        """Pitch inertia of a body of some mass about its own centre of gravity [t m2]."""
        raise NotImplementedError


class BodyInertia(CarriedBody):
    """A car body that is stated by its moment of inertia."""

    pitch_inertia_t_m2: Annotated[float, Field(gt=0, le=20_000, allow_inf_nan=False), _T_M2] = Field(
        description="pitch inertia of the body alone, about its own centre of gravity [t m2]"
    )

    def inertia_t_m2(self, own_t: float) -> float:
        """Pitch inertia of a body of some mass about its own centre of gravity [t m2]."""
        return self.pitch_inertia_t_m2


class BodyGyration(CarriedBody):
    """A car body that is stated by its radius of gyration: a heavier one resists more."""

    radius_of_gyration_m: Annotated[Metres, Field(le=20)] = Field(
        description="in place of pitch_inertia_t_m2: square root of that over the mass of the body [m]"
    )

    def inertia_t_m2(self, own_t: float) -> float:
        """Pitch inertia of a body of some mass about its own centre of gravity [t m2]."""
        return own_t * self.radius_of_gyration_m**2


class RunningBogies(Part):
    """Two equal bogies, evenly about the middle of the vehicle, with two wheelsets each."""

    centres_m: Annotated[Metres, Field(le=40)] = Field(description="distance between the two bogies [m]")
    wheelbase_m: Annotated[Metres, Field(le=10)] = Field(
        description="distance between the two wheelsets of a bogie [m]"
    )
    frame_t: _PartMass = Field(description="mass of each bogie frame [t]")
    frame_pitch_t_m2: Annotated[float, Field(gt=0, le=500, allow_inf_nan=False), _T_M2] = Field(
        description="pitch inertia of a frame about its own centre of gravity [t m2]"
    )
    wheelset_t: _PartMass = Field(description="mass of each wheelset [t]")
    axle_height_m: Annotated[Metres, Field(le=2)] = Field(
        description="height of the axles above the rail: the radius of a wheel [m]"
    )
    link_height_m: Annotated[Metres, Field(le=3)] = Field(
        description="height of the link that draws a bogie along, about which its frame pitches [m]"
    )
    cog_height_m: Annotated[Metres, Field(le=3)] = Field(
        description="height of the centre of gravity of a frame above the rail [m]"
    )

    @property
    def mass_t(self) -> float:
        """Mass of both frames and all wheelsets together [t]."""
        return 2.0 * self.frame_t + 4.0 * self.wheelset_t


class SuspensionSpec(Part):
    """A spring and a damper, and stops at both ends of the travel."""

    kN_per_mm: Annotated[float, Field(ge=1e-4, le=100, allow_inf_nan=False), _STIFFNESSES] = Field(
        description="stiffness [kN/mm]"
    )
    kN_s_per_m: Annotated[float, Field(ge=0, le=2000, allow_inf_nan=False), _DAMPERS] = Field(
        description="damping [kN s/m]"
    )
    lift_stop_mm: _Travel = Field(description="extension from the design position to the lift stop [mm], or none")
    bump_stop_mm: _Travel = Field(description="compression from there to the bump stop [mm], or none")
    stop_kN_per_mm: Annotated[float, Field(ge=1e-3, le=1000, allow_inf_nan=False), _STIFFNESSES] | None = Field(
        default=None, description="stiffness of the stops [kN/mm]; compulsory with one"
    )


class RailContact(Part):
    """The contact of a wheelset with the rail, which pushes only."""

    kN_per_mm: Annotated[
        float,
        Field(ge=1, le=20_000, allow_inf_nan=False),
        _STIFFNESSES,
        Below("stiffnesses of rails are in kN/mm; multiply by 1000 if it is in MN/mm"),
    ] = Field(default=1200.0, description="stiffness under a wheelset [kN/mm]")
    kN_s_per_m: Annotated[float, Field(ge=0, le=10_000, allow_inf_nan=False), _DAMPERS] = Field(
        default=100.0, description="damping under a wheelset [kN s/m]"
    )


class VehicleType(Part):
    """What carries a vehicle: needed in the vertical plane only."""

    body: Annotated[BodyInertia | BodyGyration, Either()] = Field(description="the car body")
    bogies: RunningBogies = Field(description="the two bogies")
    secondary: SuspensionSpec = Field(description="between body and frame, of each bogie")
    primary: SuspensionSpec = Field(description="between frame and wheelset, of each wheelset")
    rail: RailContact = Field(default=RailContact(), description="contact of each wheelset with the rail")


def type_rules(path: Path, of: VehicleType) -> Iterator[Problem]:
    """What is wrong with a type of vehicle by itself."""
    body, bogies = of.body, of.bogies
    if bogies.wheelbase_m >= bogies.centres_m:
        rule = f"must be less than the {bogies.centres_m:.12g} m between the bogies"
        yield Problem((*path, "bogies", "wheelbase_m"), rule)
    if body.cog_height_m <= bogies.axle_height_m:
        rule = f"must be above the axles, which are at {bogies.axle_height_m:.12g} m: it is that of the car body"
        yield Problem((*path, "body", "cog_height_m"), rule)
    if abs(body.cog_x_m) >= 0.5 * bogies.centres_m:
        rule = (
            f"must be between the bogies, {bogies.centres_m / 2:.12g} m from the middle of the vehicle, or one of them "
            "carries nothing"
        )
        yield Problem((*path, "body", "cog_x_m"), rule)
    for name in ("secondary", "primary"):
        suspension: SuspensionSpec = getattr(of, name)
        stops = [key for key in ("lift_stop_mm", "bump_stop_mm") if getattr(suspension, key) != "none"]
        if stops and suspension.stop_kN_per_mm is None:
            rule = f"is missing: {' and '.join(stops)} need a stiffness; add it, or state none for them"
            yield Problem((*path, name, "stop_kN_per_mm"), rule)


def carried_rules(path: Path, of: VehicleType, vehicle: str, mass_t: float, length_m: float) -> Iterator[Problem]:
    """What is wrong with a type for a vehicle of some name, mass and length, whose statement of it is at the path."""
    bogies, own_t = of.bogies, mass_t - of.bogies.mass_t
    if own_t < LEAST_MASS:
        rule = (
            f"leaves {own_t:.12g} t of the {mass_t:.12g} t of {vehicle} for the car body: frames and wheelsets together"
        )
        yield Problem(path, f"{rule} have {bogies.mass_t:.12g} t, and mass_t is that of the whole vehicle")
        return
    wheels_m = bogies.centres_m + bogies.wheelbase_m
    if wheels_m > length_m:
        rule = f"has its outer wheelsets {wheels_m:.12g} m apart, more than the {length_m:.12g} m of {vehicle}"
        yield Problem(path, f"{rule}: shorten centres_m or wheelbase_m, or check length_m")
    heavier_t = (0.5 + abs(of.body.cog_x_m) / bogies.centres_m) * own_t  # of the body, on the bogie with more of it
    for key, load_t in (("secondary", heavier_t), ("primary", 0.5 * (heavier_t + bogies.frame_t))):
        compressed_m = load_t * TONNE * G / (getattr(of, key).kN_per_mm * KN_PER_MM)
        if compressed_m > _MOST_COMPRESSION:
            rule = f"gives way by {compressed_m:.3g} m in its {key} suspension under {vehicle} as it stands"
            yield Problem(path, f"{rule}, more than {_MOST_COMPRESSION:g} m: state a stiffer kN_per_mm")
