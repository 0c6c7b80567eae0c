"""Car bodies that give: how stiff a body is, where it collapses, and what hangs below it."""

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field

from trainmj.files.parts import WHOLE, Above, Either, Part
from trainmj.files.source import Path, Problem
from trainmj.scenario.ranges import LEAST_MASS, Force, Mass, Stiffness

MAX_MEMBERS = 50

Place = Annotated[
    float,
    Field(ge=0, le=30, allow_inf_nan=False),
    Above("places along a body are in m; divide by 1000 if it is in mm"),
]


class BogiesSpec(Part):
    """Two bogies below a body, each a mass on a link along the track; they carry the weight of the vehicle."""

    mass_t: Mass = Field(description="mass of each bogie [t], a part of that of the vehicle")
    centres_m: Annotated[
        float, Field(gt=0, le=40, allow_inf_nan=False), Above("it is in m; divide by 1000 if it is in mm")
    ] = Field(description="distance between the two bogies [m]; each hangs at the nearest point between members")
    stiffness_kN_per_mm: Stiffness = Field(
        default=500.0, description="stiffness of each link [kN/mm]; soft ones are no model of a bogie that is tied"
    )


class BodySpec(Part):
    """A car body as members in a row, which shorten, yield and swing."""

    members: Annotated[int, Field(ge=1, le=MAX_MEMBERS), WHOLE] = Field(
        default=4, description="members in a row; 4 are enough for the lowest modes"
    )
    damping_ratio: Annotated[
        float, Field(ge=0, le=1, allow_inf_nan=False), Above("a ratio has no unit; divide by 100 if it is in %")
    ] = Field(default=0.02, description="damping of the lowest axial mode, as a part of the critical one")
    collapse_force_kN: Annotated[Force, Field(gt=0)] | None = Field(
        default=None, description="force at which the body collapses [kN]; it stays elastic if left out"
    )
    hardening_kN_per_mm: Annotated[
        float,
        Field(ge=0, le=50_000, allow_inf_nan=False),
        Above("slopes are in kN/mm; divide by 1000 if it is in N/mm"),
    ] = Field(
        default=0.0,
        description="slope of that force over the plastic shortening of the body [kN/mm]; with none, one member "
        "takes all of the crush",
    )
    attached_m: Annotated[list[Place], Field(min_length=2, max_length=2)] = Field(
        default_factory=lambda: [0.0, 0.0],
        description="distance from the front end, and from the rear end, to where the devices of that end are attached "
        "[m]; the nearest point between members takes them",
    )
    bogies: BogiesSpec | None = Field(default=None, description="bogies as masses of their own")

    @property
    def bogies_t(self) -> float:
        """Mass of the bogies together [t]."""
        return 2 * self.bogies.mass_t if self.bogies else 0.0

    def turned(self) -> Self:
        """The same body with its rear end in front."""
        return self.model_copy(update={"attached_m": self.attached_m[::-1]})

    @property
    def n_points(self) -> int:
        """Point masses of the vehicle."""
        return self.members + 1 + (2 if self.bogies else 0)

    def whole_kN_per_mm(self, own_t: float, length_m: float) -> float:
        """Axial stiffness EA / L of a body of some mass without bogies and length [kN/mm]."""
        raise NotImplementedError


class BodyStiffness(BodySpec):
    """A car body that is stated by its stiffness."""

    stiffness_kN_per_mm: Stiffness = Field(description="axial stiffness of the whole body, EA / L [kN/mm]")

    def whole_kN_per_mm(self, own_t: float, length_m: float) -> float:
        """Axial stiffness EA / L of a body of some mass without bogies and length [kN/mm]."""
        return self.stiffness_kN_per_mm


class BodySection(BodySpec):
    """A car body that is stated by its section."""

    EA_MN: Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False), Above("EA is in MN")] = Field(
        description="modulus of elasticity times area of the section that carries [MN]"
    )

    def whole_kN_per_mm(self, own_t: float, length_m: float) -> float:
        """Axial stiffness EA / L of a body of some mass without bogies and length [kN/mm]."""
        return self.EA_MN / length_m


class BodyFrequency(BodySpec):
    """A car body that is stated by its first axial frequency."""

    frequency_Hz: Annotated[float, Field(ge=1, le=1000, allow_inf_nan=False), Above("frequencies are in Hz")] = Field(
        description="first axial frequency of the free body without bogies, as a uniform bar: 0.5 sqrt(EA / (L M)) [Hz]"
    )

    def whole_kN_per_mm(self, own_t: float, length_m: float) -> float:
        """Axial stiffness EA / L of a body of some mass without bogies and length [kN/mm]."""
        return 4e-3 * self.frequency_Hz**2 * own_t


Body = Annotated[
    Literal["rigid"] | BodyStiffness | BodySection | BodyFrequency,
    Either(said="rigid, or a group with stiffness_kN_per_mm, EA_MN or frequency_Hz"),
]


def body_rules(path: Path, body: BodySpec, mass_t: float, length_m: float) -> Iterator[Problem]:
    """What is wrong with a body for a vehicle of some mass and length."""
    own = mass_t - body.bogies_t
    if own < LEAST_MASS:
        rule = f"leaves {own:.12g} t of {mass_t:.12g} t for the body: it is the mass of each of two bogies"
        yield Problem((*path, "bogies", "mass_t"), rule)
    if body.bogies and body.bogies.centres_m > length_m:
        yield Problem((*path, "bogies", "centres_m"), f"must be at most the length of the vehicle ({length_m:.12g} m)")
    if sum(body.attached_m) > length_m:
        rule = f"must be at most the length of the vehicle together ({length_m:.12g} m)"
        yield Problem((*path, "attached_m"), rule)
    if body.hardening_kN_per_mm and body.collapse_force_kN is None:
        rule = "needs collapse_force_kN: a body that stays elastic does not harden"
        yield Problem((*path, "hardening_kN_per_mm"), rule)
