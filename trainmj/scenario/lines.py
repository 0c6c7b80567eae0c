"""Lines along which devices act in the vertical plane, tagged by how they act: struts between pins, and faces."""

from typing import Annotated, Literal

from pydantic import Field

from trainmj.files.parts import Above, Below, Either, Part
from trainmj.scenario.ranges import Force, Friction

Ties = Literal["free", "stated", "tied"]
"""What holds ends together vertically: nothing, what the lines state, or everything."""

LineHeight = Annotated[
    float,
    Field(ge=10, le=5000, allow_inf_nan=False),
    Above("heights of lines are in mm above the rail"),
    Below("heights of lines are in mm; multiply by 1000 if it is in m"),
]


class Swing(Part):
    """The stop of a strut that has swung at its pin."""

    free_mrad: Annotated[
        float, Field(ge=0, le=1500, allow_inf_nan=False), Above("angles are in mrad; a right angle has 1571")
    ] = Field(description="angle to either side by which it swings before the stop [mrad]")
    MN_m_per_rad: Annotated[
        float,
        Field(gt=0, le=1e4, allow_inf_nan=False),
        Above("stiffnesses of stops are in MN m/rad; divide by 1000 if it is in kN m/rad"),
    ] = Field(description="stiffness of the stop [MN m/rad]")


class Tie(Part):
    """What holds two engaged faces together vertically, by friction and by teeth."""

    friction: Friction = Field(description="coefficient of friction between the faces")
    tooth_kN: Force = Field(description="vertical force that the teeth carry besides [kN]")
    kN_per_mm: Annotated[
        float,
        Field(ge=1e-3, le=5000, allow_inf_nan=False),
        Above("stiffnesses are in kN/mm; divide by 1000 if it is in N/mm"),
    ] = Field(description="stiffness along which the tie takes up its force [kN/mm]")


class AnyLine(Part):
    """What lines of both kinds have."""

    height_mm: LineHeight = Field(description="height above the rail of the vehicle as designed [mm]")


class Strut(AnyLine):
    """A coupler: it acts between its pin and that of the other side, with which it is coupled."""

    acts: Literal["strut"]
    pin_m: Annotated[
        float,
        Field(ge=0.01, le=10, allow_inf_nan=False),
        Above("it is in m; divide by 1000 if it is in mm"),
        Below("it is in m, from the pin to the coupling face"),
    ] = Field(description="from the pin to the coupling face, of one vehicle [m]")
    swing: Annotated[Literal["none"] | Swing, Either(said="none, or a group with free_mrad and MN_m_per_rad")] = Field(
        description="stop of its swing at the pin, or none"
    )


class Face(AnyLine):
    """An anti-climber or absorber: its face meets that of the other side."""

    acts: Literal["face"]
    overlap_mm: Annotated[
        float,
        Field(ge=1, le=2000, allow_inf_nan=False),
        Above("overlaps are in mm"),
        Below("overlaps are in mm; multiply by 1000 if it is in m"),
    ] = Field(description="vertical step between two such faces at which one slides off the other [mm]")
    tie: Annotated[Literal["none"] | Tie, Either(said="none, or a group with friction, tooth_kN and kN_per_mm")] = (
        Field(description="what holds them together vertically, or none")
    )


LineSpec = Annotated[Strut | Face, Either(by="acts")]
