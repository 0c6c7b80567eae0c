"""The numbers that Liu et al. 2022 print (doi 10.1186/s10033-022-00755-8), read from the CSV files in scenarios/paper.

Heads carry the units, numbers have the digits that the paper prints. Nothing computed here is ever written into them.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from trainmj.collision.envelope import Array
from trainmj.files.resources import shipped_folder
from trainmj.files.tables import read_back
from trainmj.units import head as head_of
from trainmj.units import unit_of

DOI = "10.1186/s10033-022-00755-8"

TABLES = {
    "2": "table2_scenarios",
    "3": "table3_devices_vs_D",
    "4": "table4_acceleration_vs_D",
    "5": "table5_criteria_vs_D",
    "6": "table6_devices_vs_M",
    "7": "table7_acceleration_vs_M",
    "8": "table8_criteria_vs_M",
    "9": "table9_doe_responses",
    "10": "table10_correlation",
    "Eqs": "eq7_eq8_coefficients_as_printed",
    "11": "table11_surrogate_accuracy",
    "12": "table12_entropy_weights",
    "13": "table13_optimum",
    "balance": "balance_times",
}
"""Files of the published tables, without ending, by number."""

LIMIT_ANTI_CLIMBER_MM = 265.0
"""Largest stroke of the anti-climber, Eq. (12)."""

LIMIT_OTHERS_MM = 418.0
"""Largest stroke at the other interfaces, Eq. (12)."""

BUFFER_MM = 73.0
"""Stroke of the buffers of all couplers, Section 2."""

STRONG = 0.5
"""Least |r| that Section 7 calls strong: 0.554 is, 0.446 is not."""

LIMIT_ACCELERATION_G = 5.0
"""What Section 8.2 holds the peak accelerations against."""

MASS_T = 33.0
"""Mass of every vehicle where the empty stroke varies (Section 5)."""

EMPTY_STROKE_MM = 35.0
"""Empty stroke where the mass varies (Section 6)."""

SPEED_KM_H = 25.0

STROKES = {"anti_climber_mm": "S_anti", "stroke_m1_m2_mm": "S12", "stroke_m2_m3_mm": "S23"}
ENERGIES = {"energy_s1_m1_kJ": "S1-M1", "energy_m1_m2_kJ": "M1-M2", "energy_m2_m3_kJ": "M2-M3"}
PEAKS = {f"peak_acc_m{n}_g": f"M{n}" for n in range(1, 7)}
"""Heads of strokes, energies and peak accelerations, and what they are called."""


class Series(NamedTuple):
    """Nine collisions over one factor, the other one fixed."""

    head: str  # of the factor
    axis: str  # its label
    tables: tuple[str, str, str]  # numbers: strokes and energies; peak accelerations; criteria


SERIES = {
    "D": Series("D_mm", "Empty stroke D (mm)", ("3", "4", "5")),
    "M": Series("M_t", "Mass M (t)", ("6", "7", "8")),
}
"""Sections 5 and 6: the empty stroke, and the mass."""


@cache
def _read(name: str) -> pd.DataFrame:
    return read_back(shipped_folder("scenarios") / "paper" / f"{name}.csv", follow=True)


def published(table: str) -> pd.DataFrame:
    """A copy of one published table.

    Args:
        table: its number as in TABLES, or the name of its file without ending.
    """
    return _read(TABLES.get(table, table)).copy()


def numbers(table: pd.DataFrame, head: str) -> Array:
    """A column of a table, (n,)."""
    return table[head].to_numpy(dtype=np.float64)


def number(table: str, row: str, head: str) -> float:
    """One number of a published table, by the text in its first column and the head."""
    found = published(table)
    return float(numbers(found[found.iloc[:, 0] == row], head)[0])


def change(values: ArrayLike) -> float:
    """Last value over the first, less 1 [%]."""
    first, *_, last = np.asarray(values, dtype=np.float64)
    return 100 * float(last / first - 1)


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def split_unit(head: str) -> tuple[str, str]:
    """Quantity and unit of a head: ``stroke_m1_m2_mm`` is ("stroke_m1_m2", "mm"); the unit may be empty."""
    unit = unit_of(head)
    return head.removesuffix(head_of("", unit)), unit
