"""What every input file is made of: groups whose keys are all known, numbers, names and notes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError


@dataclass(frozen=True)
class Spelt:
    """Marks text with a pattern: the rule in words, for messages, editors and the documentation."""

    rule: str

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Tell the rule to editors: Visual Studio Code and others show it instead of the pattern."""
        return handler(schema) | {"patternErrorMessage": self.rule}


LARGEST = 1e100  # sums and squares stay finite
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Name = Annotated[
    str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40), Spelt("must be a letter, then letters, digits and _")
]
Seed = Annotated[int, Field(ge=0, lt=2**32)]
Title = Annotated[str, Field(max_length=200)]
Notes = Annotated[str, Field(max_length=20_000)]


def _rising(bounds: list[float]) -> list[float]:
    low, high = bounds
    if not low < high:
        values = {"low": f"{low:g}", "high": f"{high:g}"}
        raise PydanticCustomError("bounds", "must be a lower and a higher value: {low} is not below {high}", values)
    return bounds


Bounds = Annotated[list[Number], Field(min_length=2, max_length=2), AfterValidator(_rising)]
"""A lower and a higher value."""


class Part(BaseModel):
    """A group of an input file: its keys are all known, its values fixed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
