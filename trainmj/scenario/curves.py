"""Curves and tables of a scenario file: by name, as points, or in a file."""

from typing import Annotated, Any, ClassVar

from pydantic import Field

from trainmj.files.parts import Either, Part
from trainmj.files.tables import Table, TablePlace
from trainmj.scenario.ranges import Force, Orifice, Stroke
from trainmj.units import unit_of

MAX_POINTS = 2000


class TableFile(TablePlace):
    """A table in a file beside the scenario; what it holds takes the place of this group when that is loaded."""

    columns: ClassVar[tuple[str, ...]]  # that it must have
    others: ClassVar[tuple[str, ...]] = ()  # that it may have
    texts: ClassVar[tuple[str, ...]] = ()  # columns of text; the others are numbers
    curve: ClassVar[bool] = True  # whether its columns are those of a curve
    row: ClassVar[str] = "point"  # what a row is
    most: ClassVar[int] = MAX_POINTS  # rows

    @classmethod
    def unit(cls, column: str) -> str | None:
        """The unit of a column that it may have; None for others."""
        return unit_of(column) if column in (*cls.columns, *cls.others) else None

    @classmethod
    def values_of(cls, table: Table) -> tuple[Any, dict[tuple[str | int, ...], int | None]]:
        """The plain values that a table stands for, and paths in them with the row of each, or None for several.

        Raises:
            InputError: if a cell is not what its column needs.
        """
        rows: dict[tuple[str | int, ...], int | None] = {(column,): None for column in cls.columns}
        rows |= {(column, n): n for column in cls.columns for n in range(len(table.lines))}
        return {column: table.numbers(column) for column in cls.columns}, rows


class Curve(Part):
    """Points of a force over stroke."""

    stroke_mm: Annotated[list[Stroke], Field(min_length=1, max_length=MAX_POINTS)] = Field(
        description="strokes [mm], always growing"
    )
    force_kN: Annotated[list[Force], Field(min_length=1, max_length=MAX_POINTS)] = Field(
        description="force at each stroke [kN]"
    )


class CurveFile(TableFile):
    """A curve in a file beside the scenario, with columns stroke_mm and force_kN, or those in other units."""

    columns: ClassVar = ("stroke_mm", "force_kN")


OneCurve = Annotated[str | Curve | CurveFile, Either(said="the name of a curve, or its points")]
CurveRef = Annotated[
    str | Curve | CurveFile | Annotated[list[OneCurve], Field(min_length=1, max_length=100)],
    Either(said="the name of a curve, its points, or a list of these"),
]


class Metering(Part):
    """How the orifice of a hydraulic device narrows with its stroke."""

    stroke_mm: Annotated[list[Stroke], Field(min_length=2, max_length=MAX_POINTS)] = Field(
        description="strokes [mm] from 0 to stroke_mm of the device or beyond, always growing"
    )
    orifice_kN_s2_per_m2: Annotated[list[Orifice], Field(min_length=2, max_length=MAX_POINTS)] = Field(
        description="force over the square of the speed at each stroke [kN s2/m2]"
    )


class MeteringFile(TableFile):
    """Metering in a file beside the scenario, with columns stroke_mm and orifice_kN_s2_per_m2, or in other units."""

    columns: ClassVar = ("stroke_mm", "orifice_kN_s2_per_m2")


def listed(ref: CurveRef) -> list[tuple[tuple[int, ...], str | Curve | CurveFile]]:
    """The parts of a curve, each with its position below it."""
    return [((n,), part) for n, part in enumerate(ref)] if isinstance(ref, list) else [((), ref)]
