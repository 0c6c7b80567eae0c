"""Units, read from the end of a name: ``stroke_M1_M2_mm``, ``devices.front.stiffness_kN_per_mm``."""

from __future__ import annotations

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


def label(name: str, unit: str) -> str:
    """The label of an axis: ``TS (mm)``."""
    return f"{name} ({unit})" if unit else name
