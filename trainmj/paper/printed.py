"""The numbers that Liu et al. 2022 print (doi 10.1186/s10033-022-00755-8), read from the CSV files in scenarios/paper.

A file is named after its table, heads carry the units, numbers have the digits that the paper prints. Nothing
computed here is ever written into them.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.device import Array
from trainmj.files.resources import shipped_folder
from trainmj.units import head as head_of
from trainmj.units import unit_of

if TYPE_CHECKING:
    import pandas as pd

DOI = "10.1186/s10033-022-00755-8"

LIMIT_ANTI_CLIMBER_MM = 265.0
"""Largest stroke of the anti-climber, Eq. (12)."""

LIMIT_OTHERS_MM = 418.0
"""Largest stroke at the other interfaces, Eq. (12)."""

LIMIT_ACCELERATION_G = 5.0
"""What Section 8.2 holds the peak accelerations against."""

MASS_T = 33.0
"""Mass of every vehicle where the empty stroke varies (Section 5)."""

EMPTY_STROKE_MM = 35.0
"""Empty stroke where the mass varies (Section 6)."""

SPEED_KM_H = 25.0


@cache
def _read(name: str) -> pd.DataFrame:
    from trainmj.files.tables import read_back

    return read_back(shipped_folder("scenarios") / "paper" / f"{name}.csv")


def published(name: str) -> pd.DataFrame:
    """A copy of one published table.

    Args:
        name: of its file without ending, such as ``table3_devices_vs_D``.
    """
    return _read(name).copy()


def numbers(table: pd.DataFrame, head: str) -> Array:
    """A column of a table, (n,)."""
    return table[head].to_numpy(dtype=np.float64)


def number(name: str, row: str, head: str) -> float:
    """One number of a published table, by the text in its first column and the head."""
    table = published(name)
    return float(numbers(table[table.iloc[:, 0] == row], head)[0])


def split_unit(head: str) -> tuple[str, str]:
    """Quantity and unit of a head: ``stroke_m1_m2_mm`` is ("stroke_m1_m2", "mm"); the unit may be empty."""
    unit = unit_of(head)
    return head.removesuffix(head_of("", unit)), unit
