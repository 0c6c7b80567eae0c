"""What the folder of a study holds, as its report needs it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.errors import InputError
from trainmj.files.tables import read_back
from trainmj.units import head

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Finished:
    """What the folder of a study holds.

    Attributes:
        folder: where.
        facts: of summary.json.
        tables: by file name without ending.
    """

    folder: Path
    facts: dict[str, Any]
    tables: dict[str, pd.DataFrame]

    @property
    def factors(self) -> dict[str, str]:
        """Units of the factors by their names."""
        return {name: f["unit"] for name, f in self.facts["factors"].items()}

    @property
    def responses(self) -> dict[str, str]:
        """Units of the responses by their names."""
        return {row["response"]: row["unit"] for row in self.facts["check"]["rows"]}

    def unit(self, name: str) -> str:
        """The unit of a factor or response."""
        return (self.factors | self.responses)[name]

    def column(self, name: str) -> str:
        """The head of a factor or response in the tables."""
        return head(name, self.unit(name))


def read_study(folder: Path) -> Finished:
    """Everything in the folder.

    Raises:
        InputError: if the study is not finished or a file is damaged.
    """
    try:
        facts = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        tables = {file.stem: read_back(file) for file in sorted(folder.glob("[0-9][0-9]_*.csv"))}
    except FileNotFoundError:
        raise InputError(f"{folder}: this study is not finished: the same trainmj study command goes on") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: a file of the study cannot be read ({error}): run it again") from None
    if not isinstance(facts, dict) or "check" not in facts:
        raise InputError(f"{folder}: this study is not finished: the same trainmj study command goes on")
    return Finished(folder, facts, tables)


def number(value: Any) -> str:
    """A value with five significant digits, or as it is; a dash where there is none."""
    if isinstance(value, (float, np.floating)):
        return f"{value:.5g}".replace("-", "−") if np.isfinite(value) else "–"
    return "–" if value is None else str(value)
