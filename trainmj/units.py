"""Units at the edges: SI inside, multiply on the way in, divide on the way out; and units read from names.

A name ends in its unit: ``stroke_M1_M2_mm``, ``devices.front.stiffness_kN_per_mm``.
"""

from __future__ import annotations

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

_UNITS = {
    "kN_per_mm": "kN/mm",
    "kN_s_per_m": "kN s/m",
    "km_h": "km/h",
    "mm": "mm",
    "m": "m",
    "t": "t",
    "ms": "ms",
    "s": "s",
    "g": "g",
    "kN": "kN",
    "kJ": "kJ",
}


def unit_of(name: str) -> str:
    """The unit at the end of a name; empty if there is none."""
    last = name.rpartition(".")[2]
    return next((unit for end, unit in _UNITS.items() if last.endswith(f"_{end}")), "")


def head(name: str, unit: str) -> str:
    """The head of a table's column: ``TS_mm``."""
    end = next((end for end, known in _UNITS.items() if known == unit), unit.replace("/", "_per_").replace(" ", "_"))
    return f"{name}_{end}" if unit else name


def words(name: str) -> str:
    """A name in words, without its unit: ``empty stroke`` for ``empty_stroke_mm``."""
    end = head("", unit_of(name))
    return (name.removesuffix(end) or name).replace("_", " ")


def label(name: str, unit: str) -> str:
    """The label of an axis: ``TS (mm)``."""
    return f"{name} ({unit})" if unit else name
