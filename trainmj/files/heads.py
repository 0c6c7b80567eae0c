"""Units in the heads of tables: ``Stroke [mm]``, ``force_N``, ``F / kN``, and what they are in the units of input keys.

A head that is a key of trainmj's own, such as ``force_kN``, is taken as it is. Conversions are exact: a number is taken
as the decimal that a person wrote, and rounded once.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

from trainmj.errors import InputError, close_match
from trainmj.units import KEYS, unit_of, words

Known = Callable[[str], str | None]
"""The unit of a column that a table may have, by its name, "" for none; None if it may have no such column."""

_SHOWN = 60  # characters of a head in a message
_Factors = dict[str, int | str | Fraction]
"""Units by their names, in SI units; decimals as text."""

_INCH, _POUND, _G = Fraction("0.0254"), Fraction("0.45359237"), Fraction("9.80665")
_LBF = _POUND * _G
_LENGTHS: _Factors = {
    "mm": "0.001",
    "cm": "0.01",
    "dm": "0.1",
    "m": 1,
    "km": 1000,
    "um": "1e-6",
    "µm": "1e-6",
    "μm": "1e-6",
}
_LENGTHS |= dict.fromkeys(("in", "inch", "inches", '"'), _INCH) | dict.fromkeys(("ft", "foot", "feet"), 12 * _INCH)
_FORCES: _Factors = {"N": 1, "daN": 10, "kN": 1000, "MN": 10**6, "lbf": _LBF, "kgf": _G, "kp": _G, "tf": 1000 * _G}
_FORCES |= dict.fromkeys(("kip", "kips", "klbf"), 1000 * _LBF)
_MASSES: _Factors = {"t": 1000, "tonne": 1000, "tonnes": 1000, "kg": 1}
_MASSES |= dict.fromkeys(("lb", "lbs", "lbm"), _POUND) | {"short ton": 2000 * _POUND, "long ton": 2240 * _POUND}
_TIMES: _Factors = {"s": 1, "sec": 1, "ms": "0.001", "us": "1e-6", "µs": "1e-6", "μs": "1e-6", "min": 60, "h": 3600}


def _over(above: _Factors, below: str, forms: Sequence[str], power: int = 1) -> _Factors:
    """Units over a power of another one: ``kN/mm`` of forces, "mm" and its meaning."""
    under = Fraction({**_LENGTHS, **_TIMES}[below]) ** power
    return {form.format(name): Fraction(factor) / under for name, factor in above.items() for form in forms}


_STIFFNESSES: _Factors = {}
for _below in ("mm", "cm", "m", "in", "ft"):
    _STIFFNESSES |= _over(_FORCES, _below, [f"{{}}/{_below}"])
_DAMPINGS: _Factors = {}
for _below in ("mm", "m", "in", "ft"):
    _DAMPINGS |= _over(_FORCES, _below, [f"{{}} s/{_below}", f"{{}}s/{_below}"])
_SPEEDS: _Factors = {}
for _below in ("s", "ms", "h"):
    _SPEEDS |= _over(_LENGTHS, _below, [f"{{}}/{_below}"])
_SPEEDS |= dict.fromkeys(("km h", "kmh", "kph", "km/hr"), Fraction(1000, 3600))
_SPEEDS |= {"mph": Fraction("0.44704"), "fps": 12 * _INCH}

_DIMENSIONS: dict[str, _Factors] = {
    "a length": _LENGTHS,
    "a force": _FORCES,
    "a mass": _MASSES,
    "a time": _TIMES,
    "a speed": _SPEEDS,
    "a stiffness": _STIFFNESSES,
    "a damping": _DAMPINGS,
    "a force over the square of a speed": {"kN s2/m2": 1000, "N s2/m2": 1, "kNs2/m2": 1000, "Ns2/m2": 1},
    "an acceleration": {"g": _G} | _over(_LENGTHS, "s", ["{}/s2"], 2),
    "an energy": {"J": 1, "kJ": 1000, "MJ": 10**6, "ft lbf": 12 * _INCH * _LBF, "in lbf": _INCH * _LBF},
    "an angle": {"rad": 1, "mrad": "0.001"},
    "a frequency": {"Hz": 1},
    "a stiffness in rotation": {"MN m/rad": 10**6, "kN m/rad": 1000, "N m/rad": 1},
    "a moment of inertia": {"t m2": 1000, "kg m2": 1},
    "a ratio": {"-": 1, "%": "0.01", "per mille": "0.001", "‰": "0.001"},
}


class _Unit(NamedTuple):
    dimension: str
    factor: Fraction  # to the SI unit


_UNITS = {
    name: _Unit(dimension, Fraction(factor))
    for dimension, units in _DIMENSIONS.items()
    for name, factor in units.items()
}
_CAPITALS = {name.upper(): name for name in _UNITS if len(name) > 1}  # as some write whole heads
_TWO_MEANINGS = {
    "ton": "t, short ton (2000 lb) or long ton (2240 lb)",
    "tons": "t, short ton (2000 lb) or long ton (2240 lb)",
    "kn": "kN, or km/h for knots",
    "mn": "MN or N",
    "T": "t",
    "M": "m",
    "K": "kN or kip",
    "k": "kN or kip",
    "#": "lb or lbf",
}
_OTHER_NAMES = {  # as tests and data sheets call what a curve is made of
    **dict.fromkeys(("displacement", "travel", "deflection", "compression", "crush", "hub", "weg", "s", "x"), "stroke"),
    **dict.fromkeys(("federweg", "course", "deplacement", "déplacement", "verschiebung"), "stroke"),
    **dict.fromkeys(("load", "kraft", "effort", "f", "crush_force"), "force"),
    **dict.fromkeys(("velocity", "v"), "speed"),
}

_IN_BRACKETS = re.compile(r"(?P<name>.*?)[\s_]*[\[(](?P<unit>[^\[\]()]*)[\])]")
_BEHIND = (
    re.compile(r"(?P<name>.+?)[\s_]in[\s_](?P<unit>.+)"),
    re.compile(r"(?P<name>[^/]*?)\s*/\s*(?P<unit>.+)"),
    re.compile(r"(?P<name>.*?)\s*,\s*(?P<unit>[^,]+)"),
)


class Column(NamedTuple):
    """What a column of a table is read as."""

    name: str  # as trainmj calls it
    factor: Fraction  # from its unit to that of the name
    known: bool  # whether it is one that the table may have
    unit: str = ""  # of the name
    stated: str = ""  # unit that the head, or a line below it, states

    def note(self, head_: str) -> str:
        """What was made of a head that is written otherwise; empty if it is not."""
        if not self.known or head_ == self.name:
            return ""
        times = f" by {float(self.factor):.12g}" if self.factor != 1 else ""
        return f"{head_[:_SHOWN]!r} is {self.name}{', multiplied' if times else ''}{times}"


def exactly(value: float, factor: Fraction) -> float:
    """A number in another unit: what a person wrote, multiplied, and rounded once."""
    return float(value) if factor == 1 else float(Fraction(repr(value)) * factor)


def is_unit(text: str) -> bool:
    """Whether a text is nothing but a unit, in brackets or not: a cell of a line of units below the heads."""
    return _spelt(text.strip().strip("[]()")) in _UNITS


def with_unit(head_: str, unit: str) -> str:
    """A head with the unit in the line below it."""
    bare = unit.strip().strip("[]()")
    return f"{head_} [{bare}]" if bare else head_


def factor_between(stated: str, wanted: str, said: str) -> Fraction:
    """The factor from one unit to another one.

    Args:
        stated: as a person writes it.
        wanted: as trainmj writes it; "" for a number without a unit.
        said: begins the message.

    Raises:
        InputError: if the unit is not known, may be several, or is one of something else.
    """
    if stated in _TWO_MEANINGS:
        raise InputError(f"{said}: the unit {stated!r} may mean several things: write {_TWO_MEANINGS[stated]}")
    goal = _UNITS[wanted or "-"]
    there = list(_DIMENSIONS[goal.dimension])
    unit = _UNITS.get(_spelt(stated))
    if unit is None:
        known = [name for name in there if name.isascii()]
        raise InputError(f"{said}: the unit {ascii(stated)[:_SHOWN]} is not known{close_match(stated, known[:20])}")
    if unit.dimension != goal.dimension:
        cure = {"a mass": "; a force in kg is kgf, in lb lbf, in t tf"} if goal.dimension == "a force" else {}
        rule = f"is in {stated}, {unit.dimension}, and must be {goal.dimension}"
        raise InputError(f"{said}: {rule}, such as {wanted or '%'}{cure.get(unit.dimension, '')}")
    return unit.factor / goal.factor


def read_heads(heads: Sequence[str], places: Sequence[str], known: Known, units: Mapping[str, str]) -> list[Column]:
    """What the heads of a table stand for; those that are none of the known columns stand for themselves.

    A head that is a known name goes before one that has the same name without the unit, and that before one of the
    other names of the same thing.

    Args:
        heads: as they are in the table.
        places: begin a message about each.
        known: the columns that the table may have.
        units: of heads that state none, by head or by its name.

    Raises:
        InputError: if the unit of a known column is missing, not known or of something else, or two heads may be it.
    """
    lost = dict(units)
    ranked = sorted((*_meant(text, known), k) for k, text in enumerate(heads))
    found = {k: Column(text, Fraction(1), False) for k, text in enumerate(heads)}
    best: dict[str, tuple[int, int]] = {}
    for rank, name, k in ranked:
        if not name:
            continue
        if name in best:
            if best[name][0] == rank > 0:
                both = " and ".join(repr(heads[n][:_SHOWN]) for n in (best[name][1], k))
                raise InputError(
                    f"{places[k]}heads {both} may both be {name}: rename one, or state a range with the right one"
                )
            continue
        best[name] = rank, k
        found[k] = _read_head(heads[k], places[k], name, known(name) or "", rank, lost)
    if lost:
        raise InputError(f"units: there is no head {next(iter(lost))[:_SHOWN]!r}{close_match(next(iter(lost)), heads)}")
    return [found[k] for k in range(len(heads))]


def is_named(text: str, known: Known) -> bool:
    """Whether a head stands for one of the known columns, in whatever unit."""
    return bool(_meant(text, known)[1])


def _meant(text: str, known: Known) -> tuple[int, str]:
    """How directly a head names a known column, and which; no name if it does not."""
    if known(text) is not None:
        return 0, text
    ways = [name for name, _ in _ways(text)]
    for rank, other in ((1, False), (2, True)):
        if name := next((found for way in ways if (found := _named(way, known, other))), None):
            return rank, name
    return 3, ""


def _read_head(text: str, place: str, name: str, unit: str, rank: int, units: dict[str, str]) -> Column:
    """What a head is read as that stands for a known column; takes what is used from the units that are stated."""
    said = f"{place}head {text[:_SHOWN]!r}"
    way, stated = (text, unit) if rank == 0 else next(_ways(text))
    key = next((k for k in (text, way, way.lower(), stem(name)) if k in units), None)
    if key is not None:
        given = units.pop(key)
        if stated and _spelt(stated) != _spelt(given):
            raise InputError(
                f"{said}: states the unit {stated!r}, and units.{key} states {given!r}: leave it out there"
            )
        stated = given
    if rank > 0 and way == name and unit_of(way) and factor_between(stated, unit_of(way), said) != 1:
        raise InputError(f"{said}: states two units, {unit_of(way)} and {stated}: leave the wrong one out")
    if not stated and unit:
        raise InputError(f"{said}: states no unit: write {way} [{unit}], or state units: {{ {stem(name)}: {unit} }}")
    return Column(name, factor_between(stated, unit, said) if stated else Fraction(1), True, unit, stated)


def stem(name: str) -> str:
    """A name without its unit: ``stroke`` for ``stroke_mm``."""
    return words(name).replace(" ", "_")


def unit_stated(text: str) -> str:
    """The unit that a head states; empty if it states none that is known."""
    return next((unit for _, unit in _ways(text) if _spelt(unit) in _UNITS), "")


def _ways(text: str) -> Iterator[tuple[str, str]]:
    """Name and unit of a head in each way in which it may state them; last, a name alone."""
    if found := _IN_BRACKETS.fullmatch(text):
        yield found["name"], found["unit"].strip()
        return
    for pattern in _BEHIND:
        if (found := pattern.fullmatch(text)) and _is_known(found["unit"]):
            yield found["name"], found["unit"].strip()
    parts = re.split(r"[\s_]+", text)
    for k in range(1, len(parts)):  # the longest unit first
        if _is_known(unit := " ".join(parts[k:])):
            yield "_".join(parts[:k]), unit
    yield text, ""


def _named(name: str, known: Known, other: bool) -> str | None:
    """The known column of a name without a unit, however it is written, or of another name for the same."""
    bare = re.sub(r"[\s_]+", "_", name.strip())
    tried = [_OTHER_NAMES.get(bare.lower(), "")] if other else [bare, bare.lower()]
    every = (one for each in tried if each for one in (each, *(f"{each}_{end}" for end in KEYS)))
    return next((one for one in every if known(one) is not None), None)


def _is_known(unit: str) -> bool:
    return (spelt := _spelt(unit)) in _UNITS or spelt in _TWO_MEANINGS


def _spelt(unit: str) -> str:
    """A unit as it is spelt here, if it is known."""
    text = unit.strip().removesuffix(".").replace("²", "2").replace("^", "").replace("**", "")
    text = re.sub(r"[·⋅*]", " ", text)
    text = re.sub(r"\s*/\s*|[\s_]per[\s_](?!mille)", "/", text)
    text = re.sub(r"[\s_]+", " ", text)
    return text if text in _UNITS or text in _TWO_MEANINGS else _CAPITALS.get(text, text)


def factors_of(columns: Sequence[str], units: Mapping[str, str]) -> list[Fraction]:
    """The factors of columns without heads, whose units must all be stated, by name without unit.

    Raises:
        InputError: if one is missing, not known, or of something else.
    """
    names = {stem(column): unit_of(column) for column in columns}
    if wrong := names.keys() ^ units.keys():
        example = ", ".join(f"{name}: {unit}" for name, unit in names.items())
        missing = next((name for name in names if name in wrong), None)
        rule = f"has no units of its own: state that of {missing}" if missing else f"has no {next(iter(wrong))!r}"
        raise InputError(f"{rule}, as in units: {{ {example} }}")
    return [factor_between(units[name], unit, f"units.{name}") for name, unit in names.items()]
