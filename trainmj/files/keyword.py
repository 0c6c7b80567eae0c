"""Curves in LS-DYNA keyword files: ``*DEFINE_CURVE``, with their scale factors and offsets.

Each value is scale x (number + offset), as the remarks on *DEFINE_CURVE in LS-DYNA's Keyword User's Manual say of SFA,
SFO, OFFA and OFFO. Nothing else in the file is read, and no file that it includes.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

from trainmj.errors import InputError, close_match
from trainmj.files.numbers import LARGEST

_KEYWORD = re.compile(r"\*[A-Za-z]")
_FORTRAN = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:(?:[eEdD]|(?=[+-]))[+-]?[0-9]+)?")
_SHOWN = 60
_LONGEST = 100  # characters of a number
_MOST_CURVES = 10_000
_NAMES = ("SFA", "SFO", "OFFA", "OFFO")


class DeckCurve(NamedTuple):
    """A curve as its file states it."""

    id: int
    scales: tuple[Fraction, ...]  # SFA, SFO
    offsets: tuple[Fraction, ...]  # OFFA, OFFO
    lines: list[int]  # of the points
    points: list[tuple[Fraction, Fraction]]  # as they are written

    @property
    def scaled(self) -> bool:
        """Whether it is something else than its points."""
        return any(scale != 1 for scale in self.scales) or any(self.offsets)

    def columns(self, factors: list[Fraction]) -> list[list[float]]:
        """Abscissas and ordinates, scaled, and multiplied by a factor each; every number is rounded once."""
        return [
            [float(scale * (point[k] + offset) * factor) for point in self.points]
            for k, (scale, offset, factor) in enumerate(zip(self.scales, self.offsets, factors, strict=True))
        ]


class _Block(NamedTuple):
    keyword: str
    line: int
    long: bool  # whether its fields have 20 columns
    cards: list[tuple[int, str]]  # line and text, without the title

    def head(self) -> tuple[int, list[str]]:
        """Line and fields of the first card."""
        if not self.cards:
            raise InputError(f"line {self.line}: {self.keyword} has no card")
        line, text = self.cards[0]
        return line, _fields(line, text, 20 if self.long else 10)

    def id(self) -> int:
        """The number of the curve."""
        line, fields = self.head()
        return _whole(fields[0], line, "LCID")


def is_deck(text: str) -> bool:
    """Whether a text is a keyword file: its first line that is no comment is a keyword."""
    first = next((line for line in text.split("\n", 1000) if line.strip() and not line.startswith("$")), "")
    return bool(_KEYWORD.match(first))


def curves_in(text: str) -> list[tuple[int, int]]:
    """Number and count of points of every curve in a keyword file."""
    return [(block.id(), len(block.cards) - 1) for block in _blocks(text)]


def curve_in(text: str, number: int | None) -> DeckCurve:
    """The curve of a number in a keyword file, or its only one.

    Raises:
        InputError: if there is none of the number, or are several; if it is not as LS-DYNA reads it, or states
            parameters.
    """
    blocks = _blocks(text)
    if not blocks:
        raise InputError(f"is a keyword file without *DEFINE_CURVE{_elsewhere(text)}")
    if number is None and len(blocks) > 1:
        known = ", ".join(str(block.id()) for block in blocks[:30])
        raise InputError(f"has {len(blocks)} curves: state id, one of {known}")
    found = [block for block in blocks if number is None or block.id() == number]
    if not found:
        known = close_match(str(number), [str(b.id()) for b in blocks])
        raise InputError(f"has no curve with id {number}{known}{_elsewhere(text)}")
    if len(found) > 1:
        lines = " and ".join(str(block.line) for block in found[:2])
        raise InputError(f"has two curves with id {number}, in lines {lines}")
    return _curve(found[0])


def _elsewhere(text: str) -> str:
    """What there is to know of a curve that is not in a file."""
    found = re.search(r"^\*INCLUDE\w*", text, re.MULTILINE | re.IGNORECASE)
    return f"; what its {found[0].upper()} names is not read: name that file itself" if found else ""


def _blocks(text: str) -> list[_Block]:
    """The curves of a file, in lines without comments."""
    blocks: list[_Block] = []
    block: _Block | None = None
    title = long = False
    for n, line in enumerate(text.split("\n"), 1):
        if line.startswith("$"):
            continue
        if line.startswith("*"):
            said = line.upper().rstrip()
            keyword = said.split()[0].rstrip("+-%")
            if keyword == "*KEYWORD":
                long = bool(re.search(r"\bLONG\s*=\s*Y", said))
            if keyword == "*END":
                break
            title = keyword == "*DEFINE_CURVE_TITLE"
            wide = said.endswith("+") or (long and not said.endswith("-"))
            block = _Block(keyword, n, wide, []) if title or keyword == "*DEFINE_CURVE" else None
            if block is not None:
                blocks.append(block)
            if len(blocks) > _MOST_CURVES:
                raise InputError(f"has more than {_MOST_CURVES} curves")
        elif title:
            title = False  # one line, which may be blank
        elif block is not None and line.strip():
            block.cards.append((n, line))
    return blocks


def _curve(block: _Block) -> DeckCurve:
    line, fields = block.head()
    given = [_number(field, line, name) for name, field in zip(_NAMES, fields[2:], strict=False)]
    sfa, sfo, offa, offo = (given + [Fraction(0)] * 4)[:4]
    kind = _whole(fields[6], line, "DATTYP") if len(fields) > 6 else 0
    if kind not in (0, 1):
        raise InputError(f"line {line}: DATTYP = {kind}: a force over stroke is of type 0 or 1")
    points = []
    for n, text in block.cards[1:]:
        pair = _fields(n, text, 20)
        if len(pair) < 2 or not all(pair[:2]) or any(pair[2:]):
            raise InputError(
                f"line {n}: {text.strip()[:_SHOWN]!a}: must be two numbers, in 20 columns each or with a comma"
            )
        points.append((_number(pair[0], n, "A1"), _number(pair[1], n, "O1")))
    if not points:
        raise InputError(f"line {block.line}: the curve has no points")
    scales = sfa or Fraction(1), sfo or Fraction(1)  # 0 stands for 1
    return DeckCurve(block.id(), scales, (offa, offo), [n for n, _ in block.cards[1:]], points)


def _fields(line: int, text: str, width: int) -> list[str]:
    """The fields of a card: with commas between, or in columns."""
    if "," in text:
        return [field.strip() for field in text.split(",")]
    if "\t" in (kept := text.rstrip()):  # how many columns it stands for is up to whoever shows it
        raise InputError(f"line {line}: {text.strip()[:_SHOWN]!a}: has a tab: write blanks up to the column, or commas")
    return [text[k : k + width].strip() for k in range(0, len(kept), width)]


def _whole(field: str, line: int, name: str) -> int:
    number = _number(field, line, name)
    if number.denominator != 1:
        raise InputError(f"line {line}: {name} = {field[:_SHOWN]!a}: must be a whole number")
    return int(number)


def _number(field: str, line: int, name: str) -> Fraction:
    """A number as Fortran writes it, such as 1.5D3 or 1.5+3; 0 if the field is empty."""
    if not field:
        return Fraction(0)
    said = f"line {line}: {name} = {field[:_SHOWN]!a}"
    if "&" in field or field.startswith("<"):
        raise InputError(f"{said}: is a parameter: write its value there")
    if len(field) > _LONGEST or not _FORTRAN.fullmatch(field):
        raise InputError(f"{said}: must be a number that keeps to its columns")
    text = re.sub(r"[dD]", "e", field)
    text = text if "e" in text.lower() else re.sub(r"(?<=[0-9.])([+-])", r"e\1", text)
    exponent = re.search(r"[eE](.+)", text)
    if (exponent and abs(int(exponent[1])) > 300) or abs(Fraction(text)) > LARGEST:
        raise InputError(f"{said}: must be a finite number of at most {LARGEST:g}")
    return Fraction(text)
