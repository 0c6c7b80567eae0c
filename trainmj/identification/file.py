"""The targets file as checked parts: what each key may hold, before names are looked up in scenario and tables.

Names of parameters, targets and data are the user's; a response is a sum of columns of :func:`trainmj.run_cases`.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from trainmj.files.parts import Name, Notes, Part, Seed, Title

LARGEST = 1e100  # sums and squares stay finite
_PERCENT = re.compile(r"^\s*\d{1,9}(\.\d{1,9})?\s*%\s*$")

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Step = Annotated[float, Field(ge=1e-4, le=2, allow_inf_nan=False)]


def _amount(value: Any) -> Any:
    percent = isinstance(value, str) and _PERCENT.match(value)
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if percent or (number and 0 < value <= LARGEST):
        return value
    raise PydanticCustomError("amount", "must be a number above 0, in the unit of the response, or a part such as 1 %")


Amount = Annotated[float | str, BeforeValidator(_amount)]
"""In the unit of the response, or "1 %" of the value that is wanted."""

MAX_PARAMETERS = 200
MAX_VALUES = 10_000


class SetPart(Part):
    """A value of the scenario as a straight line over a parameter: factor * parameter + offset."""

    path: str = Field(description="parameter or path of the scenario")
    factor: Number = Field(default=1.0, description="slope of the line")
    offset: Number = Field(default=0.0, description="value at a parameter of 0")


def _kind(value: Any) -> str:
    return "name" if isinstance(value, str) else "list" if isinstance(value, list) else "points"


_One = Annotated[Annotated[str, Tag("name")] | Annotated[SetPart, Tag("points")], Discriminator(_kind)]
Sets = Annotated[
    Annotated[str, Tag("name")]
    | Annotated[SetPart, Tag("points")]
    | Annotated[list[_One], Field(min_length=1, max_length=100), Tag("list")],
    Discriminator(_kind),
]


class ParameterPart(Part):
    """A value that is sought, and what it sets."""

    sets: Sets = Field(
        description="parameter or path of the scenario, or several; each may have a factor and an offset"
    )
    bounds: Annotated[list[Number], Field(min_length=2, max_length=2, description="lowest and highest value")]
    start: Number | None = Field(default=None, description="by default the value that the scenario has now")
    scale: Literal["linear", "log"] = Field(default="linear", description="log for a value that may span decades")
    above: str | None = Field(default=None, description="another parameter that this one never falls below")
    gap: NotNegative = Field(default=0.0, description="by how much it stays above")
    unit: Annotated[str, Field(pattern=r"^([A-Za-z][A-Za-z0-9 /^.]*)?$", max_length=20)] | None = Field(
        default=None, description="by default from the end of the path's name"
    )


class CurvePart(Part):
    """A curve that is sought as a whole: it rises, and its strokes, its first and its last force stay."""

    curve: str = Field(description="path of the curve, such as curves.buffer")
    slopes: Annotated[float, Field(gt=1, le=1e6, allow_inf_nan=False)] = Field(
        default=10.0, description="each slope is within this factor of their middle, before the curve gets its area"
    )


def _sought(value: Any) -> str:
    curve = "curve" in value if isinstance(value, dict) else isinstance(value, CurvePart)
    return "[curve]" if curve else "[value]"


Sought = Annotated[
    Annotated[ParameterPart, Tag("[value]")] | Annotated[CurvePart, Tag("[curve]")], Discriminator(_sought)
]


class AreaPart(Part):
    """An equality that every trial meets: the area under a curve, by one of the parameters."""

    of: str = Field(description="path of the curve, such as curves.buffer")
    from_mm: NotNegative = Field(default=0.0, description="stroke at which the area begins [mm]")
    to_mm: Positive = Field(description="stroke at which it ends [mm]")
    area_kJ: Positive = Field(description="the area, an energy [kJ]")
    by: str = Field(description="the parameter that is solved for, and so no longer sought; or the curve that is bent")
    tolerance: Amount = Field(default="0.1 %", description="what a miss counts where that parameter ends at a bound")


class BarsPart(Part):
    """What the fit of a target must keep."""

    each: Amount | None = Field(default=None, description="largest deviation of any value; the refinement keeps to it")
    rms: Amount | None = Field(default=None, description="largest root of the mean square of the deviations")
    bias: Amount | None = Field(default=None, description="largest mean of the deviations")


class TargetPart(Part):
    """A response that has values to meet."""

    response: str = Field(description="a column of the simulation's results, or a sum such as TS_mm - stroke_M1_M2_mm")
    tolerance: Amount = Field(description="standard deviation of a value, in its unit or as in 1 %")
    weight: NotNegative = Field(
        default=1.0, description="counts this much more than its tolerance says; 0 is only reported"
    )
    bars: BarsPart = Field(default=BarsPart(), description="what the fit must keep")


class DataPart(Part):
    """Where values come from: a table with a row for each case, or several joined by the columns of the cases."""

    table: str | list[str] | None = Field(default=None, description="CSV file beside this one")
    rows: Annotated[list[dict[str, Any]], Field(min_length=1, max_length=MAX_VALUES)] | None = Field(
        default=None, description="the rows themselves, instead of a table"
    )
    where: dict[str, Any] = Field(
        default_factory=dict, description="rows taken, by values of columns; a list for any of them"
    )
    leave_out: dict[str, Any] = Field(default_factory=dict, description="rows not taken, likewise")
    cases: dict[str, str] = Field(default_factory=dict, description="column: parameter or path of the scenario")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case of this table")
    values: Annotated[dict[Name, str], Field(min_length=1)] = Field(
        description="target: column, or a sum of columns such as TS_mm - coupler_mm"
    )


class ExplorePart(Part):
    """The search everywhere between the bounds: a covariance matrix adaptation evolution strategy (CMA-ES)."""

    trials: Annotated[int, Field(ge=0, le=10_000_000, description="of each search, at most; 0 for none")] = 2000
    searches: Annotated[
        int, Field(ge=1, le=100, description="of their own random numbers, side by side: valleys are many")
    ] = 1
    population: Annotated[int, Field(ge=4, le=10_000)] | None = Field(
        default=None, description="trials of a generation, one batch; by default from the number of parameters"
    )
    spread: Annotated[float, Field(gt=0, le=1, description="first standard deviation, as part of the range")] = 0.25
    start: Literal["start", "middle"] = Field(
        default="start", description="first mean: start values, or middle of the bounds"
    )
    slope_ratio: Annotated[float, Field(gt=1, le=1e6)] | None = Field(
        default=None,
        description="of neighbours in a curve that counts as one standard deviation, while exploring only; none: any",
    )
    cases: Annotated[int, Field(ge=1, le=MAX_VALUES)] | None = Field(
        default=None, description="that are simulated while exploring, spread over all of them; by default all"
    )
    step_ms: Step | None = Field(default=None, description="while exploring [ms]; by default the scenario's")


class RefinePart(Part):
    """The refinement: least squares by a trust region, derivatives by differences."""

    iterations: Annotated[int, Field(ge=0, le=10_000, description="at most; 0 for none")] = 30
    starts: Annotated[int, Field(ge=1, le=100, description="best searches whose ends are refined")] = 1
    difference: Annotated[float, Field(ge=1e-6, le=0.1, description="for derivatives, as part of the range")] = 2e-3
    step_ms: Step | None = Field(default=None, description="of the refinement [ms]; by default the scenario's")


class FinishPart(Part):
    """A second refinement in a higher norm, which makes the largest deviations smaller and all others larger."""

    norm: Annotated[float, Field(gt=2, le=32, description="exponent of the deviations")] = 8.0
    iterations: Annotated[int, Field(ge=1, le=10_000, description="at most")] = 20


class MethodPart(Part):
    """How long and how finely is searched."""

    seed: Seed = Field(default=0, description="of the exploration")
    explore: ExplorePart = Field(default=ExplorePart(), description="the search everywhere between the bounds")
    refine: RefinePart = Field(default=RefinePart(), description="the refinement by least squares")
    finish: FinishPart | None = Field(
        default=None, description="a second refinement that makes the largest misses smaller"
    )
    bar_weight: NotNegative = Field(default=10.0, description="residual of a value that is a whole bars.each beyond it")


class TargetsFile(Part):
    """A targets file: which values of a scenario are sought so that its responses meet which values."""

    title: Title = Field(default="", description="one line that heads every output")
    notes: Notes = Field(default="", description="where the numbers come from, and the like")
    scenario: str = Field(description="scenario file beside this one, or the name of a shipped one")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case")
    parameters: Annotated[dict[Name, Sought], Field(min_length=1, max_length=MAX_PARAMETERS)] = Field(
        description="values and curves that are sought, by name"
    )
    constraints: dict[Name, AreaPart] = Field(default_factory=dict, description="equalities that every trial meets")
    targets: Annotated[dict[Name, TargetPart], Field(min_length=1)] = Field(
        description="responses that have values to meet, by name"
    )
    data: Annotated[dict[Name, DataPart], Field(min_length=1)] = Field(description="the values, table by table")
    held_out: dict[Name, DataPart] = Field(default_factory=dict, description="likewise; reported, never fitted")
    method: MethodPart = Field(default=MethodPart(), description="how long and how finely is searched")
