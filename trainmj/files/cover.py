"""What heads a report: the project, whom it is for, who made it, and when."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

from trainmj.files.parts import ONE_LINE, Part

TODAY = "today"
"""The date that reads the clock, for a command; a file has no such one."""


def _whole_as_text(value: Any) -> Any:
    """A revision 2 is text, too; 1.10 would lose its nought, so that it needs quotes."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _no_clock(text: str) -> str:
    if text.strip().lower() == TODAY:
        said = "must be the day itself, as in 2026-05-04: no file reads the clock; --date today of a command does"
        raise PydanticCustomError("clock", said)
    return text


Line = Annotated[str, Field(max_length=120), BeforeValidator(_whole_as_text), ONE_LINE]


class Cover(Part):
    """What heads the page of a report; what is empty is left out."""

    project: Line = Field(default="", description="the project that the report is part of")
    client: Line = Field(default="", description="whom it is for")
    author: Line = Field(default="", description="who answers for it")
    revision: Line = Field(default="", description="of the report")
    date: Annotated[Line, AfterValidator(_no_clock)] = Field(
        default="", description="of the report, as it is to be read, such as 2026-05-04"
    )

    def over(self, given: Cover) -> Cover:
        """The same with what is given in its place."""
        return self.model_copy(update=given.stated)

    @property
    def stated(self) -> dict[str, str]:
        """What is not empty, in the order of the page."""
        return {name: text for name, text in self if text}
