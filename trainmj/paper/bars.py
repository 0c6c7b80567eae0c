"""Every item that is compared with the paper, and the bar that was wanted for it before it was reached.

The bars are those of the targets file, ``scenarios/paper/b_type.targets.yaml``, and are stated there alone; it is older
than the curves that it judges. Where it states none, an item has a bar only for a reason that does not know our result,
which stands beside it. Without a bar the deviation is shown and not judged.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

from trainmj.files.resources import shipped_folder
from trainmj.files.yaml import read_yaml
from trainmj.identification.file import BarsPart, TargetsFile, absolute
from trainmj.paper.printed import PEAKS, STROKES, number

FROM_PRINT, IDENTIFIED, HELD_OUT, ITSELF = (
    "from the paper's own numbers",
    "ours, tables that the devices were identified from",
    "ours, held out: never used to identify the devices",
    "our surrogates against our simulation",
)
GROUPS = (FROM_PRINT, IDENTIFIED, HELD_OUT, ITSELF)


class Item(NamedTuple):
    """A quantity that is compared."""

    group: str  # one of GROUPS
    said: str  # what is compared, in words
    tables: str  # numbers of the published tables; of two, over D and over M, the case that both have counts once
    heads: tuple[str, ...]  # of the quantity in them, or of several
    measure: str  # "largest" of all deviations, their "rms" or "mean", or the largest of "each" of several heads
    relative: bool  # to the published values; otherwise deviations have the unit of the head
    target: str = ""  # whose bar it has in the targets file
    digits: int = 1  # of the values as they are shown
    known: float | None = None  # a bar from elsewhere

    @property
    def bar(self) -> float | None:
        """Most that was wanted, as part of the published value where relative; None where nothing was."""
        if not self.target:
            return self.known
        amount = getattr(_stated()[self.target], _IN_THE_FILE[self.measure])
        return None if amount is None else absolute(amount, 1.0)


_IN_THE_FILE = {"largest": "each", "each": "each", "rms": "rms", "mean": "bias"}

MEANS_OF_7 = "7, means of rows"
"""Stands for the TAMA that Table 8 should have, in the place of a number of a table."""

COUPLER_MM = 0.5
"""The coupler is used up in every case: 353 mm, printed without decimals."""


def balance_time_bar() -> float:
    """Largest deviation wanted of a balance time, relative."""
    return absolute(_stated()["t_M1"].each, 1.0)


@cache
def _stated() -> Mapping[str, BarsPart]:
    """The bars of the targets file, by target."""
    file = shipped_folder("scenarios") / "paper" / "b_type.targets.yaml"
    return {name: part.bars for name, part in read_yaml(file).checked(TargetsFile).targets.items()}


def _strokes(group: str, tables: str) -> list[Item]:
    said = f"Table{'s' * (' ' in tables)} {tables.replace(' ', ', ')}"
    return [
        Item(group, f"{said}: {name}", tables, (head,), measure, False, name)
        for head, name in STROKES.items()
        for measure in ("rms", "mean")
    ]


ITEMS = (
    Item(IDENTIFIED, "Tables 4, 7: each peak acceleration", "4 7", tuple(PEAKS), "each", True, "a_M1"),
    *(
        Item(IDENTIFIED, f"Tables 4, 7: peak of {m}", "4 7", (head,), "rms", False, f"a_{m}", 4)
        for head, m in PEAKS.items()
    ),
    *_strokes(IDENTIFIED, "3 6"),
    Item(IDENTIFIED, "Tables 3, 6: energy of S1-M1", "3 6", ("energy_s1_m1_kJ",), "rms", True, digits=0),
    Item(IDENTIFIED, "Tables 3, 6: energy of M1-M2", "3 6", ("energy_m1_m2_kJ",), "rms", True, digits=0),
    Item(IDENTIFIED, "Tables 3, 6: energy of M2-M3", "3 6", ("energy_m2_m3_kJ",), "rms", True, digits=0),
    Item(IDENTIFIED, "Tables 3, 6: coupler used up", "3 6", ("coupler_mm",), "largest", False, known=COUPLER_MM),
    Item(IDENTIFIED, "Tables 5, 8: TS", "5 8", ("TS_mm",), "largest", True, "TS"),
    Item(IDENTIFIED, "Table 5: TAMA", "5", ("TAMA_g",), "largest", True, "TAMA", 4),
    Item(IDENTIFIED, "Table 7: mean of each row (TAMA)", MEANS_OF_7, ("TAMA_g",), "largest", True, digits=4),
    Item(IDENTIFIED, "Table 8: TAMA (see the defects)", "8", ("TAMA_g",), "largest", True, digits=4),
    Item(HELD_OUT, "Table 9: TS", "9", ("TS_mm",), "largest", True, "TS_of_table_9"),
    *_strokes(HELD_OUT, "9"),
    Item(HELD_OUT, "Table 9: peak of M1 (see the defects)", "9", ("peak_acc_m1_g",), "largest", True, digits=2),
    Item(HELD_OUT, "Table 9: peak of M2 (see the defects)", "9", ("peak_acc_m2_g",), "largest", True, digits=2),
    Item(HELD_OUT, "Table 9: TAMA (see the defects)", "9", ("TAMA_g",), "largest", True, digits=2),
    Item(HELD_OUT, "Table 13: TS", "13", ("TS_mm",), "largest", True, "TS_of_table_13", 2),
    Item(HELD_OUT, "Table 13: TAMA, printed to 0.01 g", "13", ("TAMA_g",), "largest", False, "TAMA_of_table_13", 4),
    Item(HELD_OUT, "Balance times", "balance", ("balance_time_s",), "largest", True, "t_M1", 3),
)
"""What our collisions are compared in."""


def surrogate_bar(criterion: str) -> float:
    """Our surrogates should miss our simulation by no more than the paper's miss its own (Table 13), relative."""
    return number("table13_relative_errors", criterion, "relative_error_percent") / 100


MISSED = frozenset(
    (
        "Tables 4, 7: each peak acceleration",
        "Tables 5, 8: TS",
        "Table 9: TS",
        "Table 9: S12, rms",
        "Table 9: S12, mean deviation",
        "Table 9: S23, rms",
    )
)
"""Verdicts whose bars the curves of ``b_type`` miss, whatever the machine: ``trainmj verify`` names them instead."""
