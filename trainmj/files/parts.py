"""What every input file is made of: groups whose keys are all known, numbers, names and notes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


@dataclass(frozen=True)
class Spelt:
    """Marks text with a pattern: what to say of one that does not match it."""

    rule: str


Number = Annotated[float, Field(ge=-1e100, le=1e100, allow_inf_nan=False)]  # sums and squares stay finite
Name = Annotated[
    str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40), Spelt("must be a letter, then letters, digits and _")
]
Seed = Annotated[int, Field(ge=0, lt=2**32)]
Title = Annotated[str, Field(max_length=200)]
Notes = Annotated[str, Field(max_length=20_000)]


class Part(BaseModel):
    """A group of an input file: its keys are all known, its values fixed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
