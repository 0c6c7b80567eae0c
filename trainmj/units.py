"""Units at the edges: SI inside, multiply on the way in, divide on the way out; units of input keys; digits to read.

A key of an input file ends in its unit: ``empty_stroke_mm``, ``devices.front.stiffness_kN_per_mm``. The units of
responses are in their table, :mod:`trainmj.collision.quantities`, and are never read from names.
"""

from __future__ import annotations

import math
import re
from decimal import ROUND_FLOOR, Context
from typing import TYPE_CHECKING, Any, overload

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]
    BoolArray = npt.NDArray[np.bool_]

G = 9.80665
"""Standard gravity [m/s2], by which accelerations are reported in g."""

MM = 1e-3
KN = 1e3
KJ = 1e3
TONNE = 1e3
MS = 1e-3
KM_H = 1.0 / 3.6
KN_PER_MM = 1e6
KN_S_PER_M = 1e3
MN_M = 1e6
MRAD = 1e-3

ROUND_OFF = 1e-9
"""Part of a limit by which a value may pass it and still keep it: rounding in the last digits breaks no limit."""

_MOST_MORE = 4  # decimals than full-size trains need
_MOST_DIGITS = 17  # tell any two numbers apart

_UNITS = {
    "m_per_s2": "m/s2",
    "m_per_s": "m/s",
    "kN_per_mm": "kN/mm",
    "kN_s2_per_m2": "kN s2/m2",
    "kN_s_per_m": "kN s/m",
    "MN_m_per_rad": "MN m/rad",
    "mrad": "mrad",
    "t_m2": "t m2",
    "per_mille": "per mille",
    "km_h": "km/h",
    "mm": "mm",
    "m": "m",
    "t": "t",
    "ms": "ms",
    "s": "s",
    "g": "g",
    "kN": "kN",
    "MN": "MN",
    "Hz": "Hz",
    "kJ": "kJ",
}

KEYS = tuple(_UNITS)
"""Units as input keys and heads of tables end in them."""

_FOR = re.compile(r"\.([MS]\d*)$")  # the vehicle or side that a value is for: offset_mm.M, pitch_mrad.M1


def unit_of(name: str) -> str:
    """The unit at the end of an input key or path; empty if there is none, or one that is not known."""
    last = "_" + _FOR.sub("", name).rpartition(".")[2]  # a key may be a unit alone, as kN_per_mm of a suspension
    end = next((end for end in _UNITS if last.endswith(f"_{end}")), "")
    return "" if not end or last.endswith(f"_per_{end}") else _UNITS[end]


def head(name: str, unit: str) -> str:
    """The head of a table's column: ``TS_mm``."""
    end = next((end for end, known in _UNITS.items() if known == unit), unit.replace("/", "_per_").replace(" ", "_"))
    return f"{name}_{end}" if unit else name


def words(name: str) -> str:
    """A name in words, without its unit: ``empty stroke`` for ``empty_stroke_mm``, ``tie`` for ``tie.kN_per_mm``."""
    end, of = head("", unit_of(name)), _FOR.search(name)
    bare = _FOR.sub("", name)
    return (bare.removesuffix(end).removesuffix(f".{end[1:]}") or bare).replace("_", " ") + (f" {of[1]}" if of else "")


def label(name: str, unit: str) -> str:
    """The label of an axis: ``TS (mm)``."""
    return f"{name} ({unit})" if unit else name


def in_digits(value: float, digits: int) -> str:
    """A value with so many decimals or, if negative, significant digits; a dash if it is not a number."""
    if math.isnan(value):
        return "-"
    return f"{value:.{digits}f}" if digits >= 0 else f"{value:.{-digits}g}"


def enough(digits: int, largest: float) -> int:
    """Decimals that show three digits of the largest of some values, at least those given, which full-size trains need.

    What needs many more is what round-off leaves of nothing.
    """
    more = 2 - math.floor(math.log10(largest)) - digits if 0.0 < largest < math.inf else 0
    return digits + more if 0 < more <= _MOST_MORE else digits


def readable(value: float, digits: int) -> str:
    """A value with so many decimals, or more if that shows fewer than three digits of it."""
    return in_digits(value, enough(digits, abs(value)))


@overload
def beyond(value: float, limit: float) -> bool: ...
@overload
def beyond(value: FloatArray, limit: FloatArray) -> BoolArray: ...
def beyond(value: Any, limit: Any) -> Any:
    """Whether a value is above a limit by more than round-off; never if it is not a number."""
    return value - limit > ROUND_OFF * abs(limit)


def against(value: float, limit: float | None, digits: int) -> str:
    """A value beside a limit: as :func:`in_digits`, with as many more digits as it takes to tell the two apart.

    Whether it is above the limit, below it or equal, in sign and in magnitude, is then read as it is judged by
    :func:`beyond`: 380.04 beside 380 is not 380.0. Every value that is shown with a verdict on it is shown so.
    """
    shown = in_digits(value, digits)
    if limit is None or not math.isfinite(value) or not math.isfinite(limit):
        return shown
    if not any(beyond(*pair) for pair in ((value, limit), (limit, value))):
        return shown
    while abs(digits) < _MOST_DIGITS and _sides(float(shown), limit) != _sides(value, limit):
        digits += 1 if digits >= 0 else -1
        shown = in_digits(value, digits)
    return shown


def rounded_down(value: float, digits: int) -> str:
    """The largest number of so many significant digits that is not above a positive value: a limit that may be used."""
    return f"{float(Context(prec=digits, rounding=ROUND_FLOOR).create_decimal(repr(value))):.12g}"


def _sides(value: float, limit: float) -> tuple[bool, ...]:
    return value > limit, value < limit, abs(value) > abs(limit), abs(value) < abs(limit)
