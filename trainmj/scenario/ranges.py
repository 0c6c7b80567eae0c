"""The numbers and names of a scenario file: what each may be, and what is probably wrong with one beyond it."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from trainmj.files.parts import WHOLE, Above, Spelt

# Beyond every vehicle and device, but below almost all that is stated in a wrong unit. Car bodies are proved to 2000 kN
# and whole ends crush at some 20 000 kN. A solid cube of steel with edges of 240 mm has 50 000 kN/mm; on half of that a
# dashpot of 100 000 kN s/m damps 100 t critically. A crush zone of 10 m is half a car.
MAX_FORCE = 50_000.0  # [kN]
Force = Annotated[
    float,
    Field(ge=0, le=MAX_FORCE, allow_inf_nan=False),
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
Orifice = Annotated[
    float,
    Field(ge=0, le=100_000, allow_inf_nan=False),
    Above("orifice constants are in kN s2/m2; divide by 1000 if it is in N s2/m2"),
]
Gap = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False), Above("gaps are in mm")]
LEAST_MASS, MAX_MASS = 1e-3, 200.0  # of a vehicle [t]; the lightest ones are those of models
Mass = Annotated[
    float,
    Field(ge=LEAST_MASS, le=MAX_MASS, allow_inf_nan=False, description="mass of a vehicle [t]"),
    Above("masses are in t; divide by 1000 if it is in kg"),
]
Length = Annotated[
    float,
    Field(ge=0.5, le=60, allow_inf_nan=False, description="length of a vehicle [m]"),
    Above("lengths are in m; divide by 1000 if it is in mm"),
]
Metres = Annotated[
    float,
    Field(gt=0, allow_inf_nan=False),
    Above("it is in m; divide by 1000 if it is in mm"),
]
"""A distance or height of a vehicle, above 0; whoever uses it states the largest."""

Friction = Annotated[
    float,
    Field(ge=0, le=1, allow_inf_nan=False),
    Above("a coefficient of friction has no unit; divide by 100 if it is in %"),
]
MAX_FLIGHTS = 5


def _rising(flights: list[int]) -> list[int]:
    twice = [str(flight) for flight in dict.fromkeys(flights) if flights.count(flight) > 1]
    if twice:
        raise PydanticCustomError("flights", "states {twice} more than once", {"twice": ", ".join(twice)})
    return sorted(flights)


# Whole, as a distance is part of the names of its responses. Below 50 mm the default records are too far apart.
Flight = Annotated[int, Field(ge=50, le=10_000), WHOLE, Above("free flights are in mm; none is longer than 10 m")]
Flights = Annotated[
    list[Flight], Field(max_length=MAX_FLIGHTS, json_schema_extra={"uniqueItems": True}), AfterValidator(_rising)
]
"""Distances that occupants fly freely [mm], rising."""
Seconds = Annotated[float, Field(ge=0, le=60, allow_inf_nan=False), Above("it is in s; divide by 1000 if it is in ms")]
Step = Annotated[float, Field(ge=1e-4, le=2, allow_inf_nan=False)]
Speed = Annotated[float, Field(ge=-200, le=200, allow_inf_nan=False, description="speed along +x [km/h]")]
Key = Annotated[
    str,
    Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=60),
    Spelt("must be a letter or _, then letters, digits and _"),
]
SideOrVehicle = Annotated[
    str,
    Field(pattern=r"^[MS]\d{0,3}$"),
    Spelt("must be a side, M or S, or a single vehicle, such as M1"),
]
"""All vehicles of a side, or one."""

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
