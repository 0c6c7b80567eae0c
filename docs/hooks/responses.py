"""The page of the responses, made from the table of quantities."""

from __future__ import annotations

from trainmj.collision.quantities import (
    BALANCE,
    COLLISION,
    ENDS,
    INTERFACE,
    MEMBER,
    POINT,
    STAGE,
    TRAIN,
    WHEELSET,
    Quantity,
    groups,
)

_INTRODUCTION = """# Responses

Every number that is computed for a collision: its name in JSON, `interfaces.csv`, `vehicles.csv`, `wheelsets.csv`,
`bodies.csv` and Python, and its column in a sweep, a study or a targets file. Interfaces are named from the front:
`S1_M1` is the front, `M1_M2` the coupler behind the head car of the moving train, and `S1_S2` that of its partner.
"""

_THINGS = {INTERFACE: "M1-M2", (STAGE,): "S1-M1 anti_climber", TRAIN: "", COLLISION: "", BALANCE: ""}
_THINGS |= {MEMBER: "M1 member 1", POINT: "M1 2", ENDS: "M1-M2", WHEELSET: "M1 wheelset 1"}


def page() -> str:
    """All quantities, grouped by what they belong to."""
    parts = [_INTRODUCTION]
    for title, quantities in groups().items():
        thing = _THINGS.get(quantities, "M1")
        rows = ["| name | column, for example | unit | meaning |", "|---|---|---|---|"]
        rows += [_row(q, thing) for q in quantities]
        parts += [f"## {title}", "\n".join(rows)]
    return "\n\n".join(parts) + "\n"


def _row(quantity: Quantity, thing: str) -> str:
    column = f"`{quantity.head_of(thing)}`" if quantity.column else ""
    meaning = quantity.meaning.replace("|", "\\|")
    return f"| `{quantity.name}` | {column} | {quantity.unit} | {meaning} |"
