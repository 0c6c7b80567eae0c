"""The targets file as checked parts: what each key may hold, before names are looked up in scenario and tables.

Names of parameters, targets and data are the user's; a response is a sum of columns of :func:`trainmj.run_cases`, a
channel one of those of :mod:`trainmj.collision.channels`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from trainmj.files.parts import (
    WHOLE,
    Bounds,
    Either,
    Name,
    Notes,
    NotNegative,
    Number,
    Part,
    Positive,
    Seed,
    Spelt,
    Title,
)
from trainmj.files.source import Path
from trainmj.files.tables import OneTable, TablePlace
from trainmj.scenario.ranges import Step
from trainmj.units import MS

MAX_PARAMETERS = 200
MAX_VALUES = 10_000

_AMOUNT = "a number above 0, in the unit of the response, or a percentage such as 1 %"

Unit = Annotated[
    str,
    Field(pattern=r"^([A-Za-z][A-Za-z0-9 /^.]*)?$", max_length=20),
    Spelt("must be a letter, then letters, digits, spaces and / ^ ."),
]
Amount = Annotated[
    Positive | Annotated[str, Field(pattern=r"^\s*[0-9]{1,9}(\.[0-9]{1,9})?\s*%\s*$"), Spelt(f"must be {_AMOUNT}")],
    Either(said=_AMOUNT),
]
"""In the unit of the response, or "1 %" of the value that is wanted."""


def absolute(amount: Amount | None, wanted: float) -> float:
    """An amount in the unit of the response, a percentage of the value that is wanted; infinite if none is stated."""
    if isinstance(amount, str):
        return float(amount.strip().removesuffix("%")) / 100.0 * abs(wanted)
    return math.inf if amount is None else amount


class SetPart(Part):
    """A value of the scenario as a straight line over a parameter: factor * parameter + offset."""

    path: str = Field(description="parameter or path of the scenario")
    factor: Number = Field(default=1.0, description="slope of the line")
    offset: Number = Field(default=0.0, description="value at a parameter of 0")

    def of(self, parameter: float) -> float:
        """What the path is set to."""
        return self.factor * parameter + self.offset


_SET = "a path or parameter of the scenario, or a group with one under path"
OneSet = Annotated[str | SetPart, Either(said=_SET)]
Sets = Annotated[
    str | SetPart | Annotated[list[OneSet], Field(min_length=1, max_length=100)],
    Either(said=f"{_SET}, or a list of these"),
]


class ParameterPart(Part):
    """A single value that is sought, and what it sets."""

    sets: Sets = Field(
        description="parameter or path of the scenario, or several; each may have a factor and an offset"
    )
    bounds: Bounds = Field(description="lowest and highest value")
    start: Number | None = Field(default=None, description="by default the value that the scenario has now")
    scale: Literal["linear", "log"] = Field(default="linear", description="log for a value that may span decades")
    above: str | None = Field(default=None, description="another parameter that this one never falls below")
    gap: NotNegative = Field(default=0.0, description="by how much it stays above")
    unit: Unit | None = Field(default=None, description="by default from the end of the path's name")

    def listed(self) -> list[tuple[Path, SetPart]]:
        """Everything that it sets, each with its place below the parameter."""
        if isinstance(self.sets, list):
            given: list[tuple[Path, str | SetPart]] = [(("sets", n), one) for n, one in enumerate(self.sets)]
        else:
            given = [(("sets",), self.sets)]
        return [(at, SetPart(path=one) if isinstance(one, str) else one) for at, one in given]


class CurvePart(Part):
    """A curve that is sought as a whole: it rises, and its strokes, its first and its last force stay."""

    curve: str = Field(description="path of the curve, such as curves.buffer")
    slopes: Annotated[float, Field(gt=1, le=1e6, allow_inf_nan=False)] = Field(
        default=10.0, description="each slope is within this factor of their middle, before the curve gets its area"
    )


class OffsetPart(Part):
    """The time offset between channels of a test and the simulation, sought with the other parameters."""

    offset: Annotated[
        str | Annotated[list[str], Field(min_length=1)], Either(said="the name of channels in data, or a list of names")
    ] = Field(description="entry of data whose times it shifts, or several that have one clock")
    bounds: Bounds = Field(description="smallest and largest offset [ms], as offset_ms of the entry")
    start: Number | None = Field(default=None, description="by default the offset_ms of the entry [ms]")

    @property
    def shifted(self) -> list[str]:
        """The entries whose times it shifts."""
        return [self.offset] if isinstance(self.offset, str) else self.offset


class AreaPart(Part):
    """An equality that every trial meets: the area under a curve, by one of the parameters."""

    of: str = Field(description="path of the curve, such as curves.buffer")
    from_mm: NotNegative = Field(default=0.0, description="stroke at which the area begins [mm]")
    to_mm: Positive = Field(description="stroke at which it ends [mm]")
    area_kJ: Positive = Field(description="the area, an energy [kJ]")
    by: str = Field(description="the parameter that is solved for, and so no longer sought; or the curve that is bent")
    tolerance: Amount = Field(
        default="0.1 %", description="deviation that counts as one where that parameter ends at a bound"
    )


class BarsPart(Part):
    """What the fit of a target must keep."""

    each: Amount | None = Field(default=None, description="largest deviation of any value; the refinement keeps to it")
    rms: Amount | None = Field(default=None, description="largest root of the mean square of the deviations")
    bias: Amount | None = Field(default=None, description="largest mean of the deviations")


class _Target(Part):
    tolerance: Amount = Field(description="standard deviation of a value, in its unit or as in 1 %")
    weight: NotNegative = Field(
        default=1.0, description="counts this much more than its tolerance says; 0 is only reported"
    )
    bars: BarsPart = Field(default=BarsPart(), description="what the fit must keep")


class TargetPart(_Target):
    """A response that has values to meet."""

    response: str = Field(description="a column of the simulation's results, or a sum such as TS_mm - stroke_M1_M2_mm")

    @property
    def asked(self) -> tuple[str, str]:
        """Key and text of what has values to meet."""
        return "response", self.response


class ChannelTarget(_Target):
    """A channel that has values over time to meet; its root mean square deviation counts as one value."""

    channel: str = Field(
        description="velocity_M1_km_h, acceleration_cfc60_M1_g or that of another vehicle, or a sum of these"
    )
    tolerance: Positive = Field(description="standard deviation of its values, in their unit")
    independent_ms: Positive | None = Field(
        default=None,
        description="time after which deviations are independent [ms]: the channel counts as one value for each; by "
        "default it counts as one",
    )

    @property
    def asked(self) -> tuple[str, str]:
        """Key and text of what has values to meet."""
        return "channel", self.channel

    def share(self, time: Sequence[float]) -> float:
        """As how many values each sample counts, where these are the times of all (n,) [s]."""
        span = (time[-1] - time[0]) / MS
        count = 1.0 if self.independent_ms is None else min(max(1.0, span / self.independent_ms), float(len(time)))
        return count / len(time)


class _Data(Part):
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case of this table")
    values: Annotated[dict[Name, str], Field(min_length=1)] = Field(
        description="target: column, or a sum of columns such as TS_mm - coupler_mm"
    )

    @property
    def places(self) -> list[str | TablePlace]:
        """The tables that it is read from."""
        return []


class _Rows(_Data):
    where: dict[str, Any] = Field(
        default_factory=dict, description="rows that are used, by values of columns; a list for any of them"
    )
    leave_out: dict[str, Any] = Field(default_factory=dict, description="rows that are left out, likewise")
    cases: dict[str, str] = Field(default_factory=dict, description="column: parameter or path of the scenario")


class TableData(_Rows):
    """Values in a CSV table with a row for each case, or in several tables joined by the columns of the cases."""

    table: Annotated[
        str | TablePlace | Annotated[list[OneTable], Field(min_length=1)],
        Either(said="the name of a file, a group with file, sheet and range, or a list of these"),
    ] = Field(description="CSV file or workbook beside this one, or several")

    @property
    def places(self) -> list[str | TablePlace]:
        """The tables that it is read from."""
        return list(self.table) if isinstance(self.table, list) else [self.table]


class RowsData(_Rows):
    """Values in the targets file itself."""

    rows: Annotated[list[dict[str, Any]], Field(min_length=1, max_length=MAX_VALUES)] = Field(
        description="a group for each case, its columns by name"
    )


class ChannelData(_Data):
    """Channels of one test in a file: a column of times, and one for each channel."""

    channels: OneTable = Field(description="CSV file or workbook beside this one")
    time: str = Field(description="column of its times [s], or a sum such as 0.001 * time_ms")
    offset_ms: Number = Field(
        default=0.0, description="added to these times, it gives those of the simulation, which begins at 0 [ms]"
    )
    between_s: Bounds | None = Field(default=None, description="first and last of its times that are used [s]")
    set: dict[str, Any] = Field(default_factory=dict, description="values of the scenario in this test")

    @property
    def places(self) -> list[str | TablePlace]:
        """The tables that it is read from."""
        return [self.channels]


DataPart = Annotated[TableData | RowsData | ChannelData, Either()]


class ExplorePart(Part):
    """The search everywhere between the bounds: a covariance matrix adaptation evolution strategy (CMA-ES)."""

    trials: Annotated[int, Field(ge=0, le=10_000_000, description="most trials of each search; 0 for none"), WHOLE] = (
        2000
    )
    searches: Annotated[
        int, Field(ge=1, le=100, description="searches side by side, each with random numbers of its own"), WHOLE
    ] = 1
    population: Annotated[int, Field(ge=4, le=10_000), WHOLE] | None = Field(
        default=None, description="trials of a generation, one batch; by default from the number of parameters"
    )
    spread: Annotated[float, Field(gt=0, le=1, description="first standard deviation, as part of the range")] = 0.25
    start: Literal["start", "middle"] = Field(
        default="start", description="first mean: start values, or middle of the bounds"
    )
    slope_ratio: Annotated[float, Field(gt=1, le=1e6)] | None = Field(
        default=None,
        description="ratio of neighbouring slopes of a curve that counts as one standard deviation while exploring; "
        "by default any ratio is as good",
    )
    cases: Annotated[int, Field(ge=1, le=MAX_VALUES), WHOLE] | None = Field(
        default=None, description="how many cases are simulated while exploring, spread over all; by default all"
    )
    step_ms: Step | None = Field(default=None, description="step while exploring [ms]; by default the scenario's")


class RefinePart(Part):
    """The refinement: least squares by a trust region, derivatives by differences."""

    iterations: Annotated[int, Field(ge=0, le=10_000, description="most iterations; 0 for none"), WHOLE] = 30
    starts: Annotated[int, Field(ge=1, le=100, description="how many searches are refined, the best first"), WHOLE] = 1
    difference: Annotated[float, Field(ge=1e-6, le=0.1, description="for derivatives, as part of the range")] = 2e-3
    step_ms: Step | None = Field(default=None, description="step of the refinement [ms]; by default the scenario's")


class FinishPart(Part):
    """A second refinement in a higher norm, which makes the largest deviations smaller and all others larger."""

    norm: Annotated[float, Field(gt=2, le=32, description="exponent of the deviations")] = 8.0
    iterations: Annotated[int, Field(ge=1, le=10_000, description="most iterations"), WHOLE] = 20


class MethodPart(Part):
    """How long and how finely to search."""

    seed: Seed = Field(default=0, description="of the exploration")
    explore: ExplorePart = Field(default=ExplorePart(), description="the search everywhere between the bounds")
    refine: RefinePart = Field(default=RefinePart(), description="the refinement by least squares")
    finish: FinishPart | None = Field(
        default=None, description="a second refinement that makes the largest deviations smaller"
    )
    bar_weight: NotNegative = Field(default=10.0, description="residual of a value that is a whole bars.each beyond it")


class TargetsFile(Part, title="targets file"):
    """A targets file: which values of a scenario are sought so that its responses meet which values."""

    title: Title = Field(default="", description="one line that heads every output")
    notes: Notes = Field(default="", description="such as where the numbers come from")
    scenario: str = Field(description="scenario file beside this one, or the name of a shipped one")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case")
    parameters: Annotated[
        dict[Name, Annotated[ParameterPart | CurvePart | OffsetPart, Either()]],
        Field(min_length=1, max_length=MAX_PARAMETERS),
    ] = Field(description="values, curves and time offsets that are sought, by name")
    constraints: dict[Name, AreaPart] = Field(default_factory=dict, description="equalities that every trial meets")
    targets: Annotated[dict[Name, Annotated[TargetPart | ChannelTarget, Either()]], Field(min_length=1)] = Field(
        description="responses and channels that have values to meet, by name"
    )
    data: Annotated[dict[Name, DataPart], Field(min_length=1)] = Field(description="the values, table by table")
    held_out: dict[Name, DataPart] = Field(default_factory=dict, description="likewise; reported, never fitted")
    method: MethodPart = Field(default=MethodPart(), description="how long and how finely to search")

    def singles(self) -> dict[str, ParameterPart]:
        """The parameters that are single values."""
        return {name: part for name, part in self.parameters.items() if isinstance(part, ParameterPart)}

    def curves(self) -> dict[str, CurvePart]:
        """The parameters that are curves."""
        return {name: part for name, part in self.parameters.items() if isinstance(part, CurvePart)}

    def offsets(self) -> dict[str, OffsetPart]:
        """The parameters that are time offsets."""
        return {name: part for name, part in self.parameters.items() if isinstance(part, OffsetPart)}

    def tables(self) -> list[tuple[Path, TableData | RowsData | ChannelData]]:
        """Every entry of data and held_out, with its place."""
        return [((key, name), part) for key in ("data", "held_out") for name, part in getattr(self, key).items()]

    def channels(self) -> dict[str, ChannelData]:
        """The entries that are channels."""
        return {str(at[1]): part for at, part in self.tables() if isinstance(part, ChannelData)}
