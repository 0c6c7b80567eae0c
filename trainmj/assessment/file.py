"""The assessment file as checked parts: collision scenarios, their limits, and what no computation here answers."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from trainmj.files.parts import Above, Either, Notes, Part, Positive, Spelt, Title
from trainmj.files.provenance import Sources
from trainmj.scenario.ranges import Key, Response
from trainmj.scenario.trains import End

IDENTICAL = "identical"
"""The partner that is the train under test itself."""

Speed = Annotated[float, Field(gt=0, le=200, allow_inf_nan=False), Above("speeds are in km/h")]
Category = Annotated[
    str,
    Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=40),
    Spelt("must be a letter, then letters, digits, - and _"),
]


class FromLineSpeed(Part):
    """A speed that follows from that of the line."""

    line_speed_less_km_h: Annotated[float, Field(ge=0, le=500)] = Field(
        description="the speed is that of the line less this [km/h]"
    )
    at_most_km_h: Speed = Field(description="and at most this, which is taken if no line speed is given [km/h]")

    def at(self, line_speed_km_h: float | None) -> float:
        """The speed on a line [km/h]; the highest one if the line speed is not known."""
        less = self.line_speed_less_km_h
        return self.at_most_km_h if line_speed_km_h is None else min(self.at_most_km_h, line_speed_km_h - less)


OneSpeed = Annotated[Speed | FromLineSpeed, Either(said="a speed, or a group with line_speed_less_km_h")]


class LoadState(Part):
    """How many seats are taken: it replaces what the train states under load."""

    title: Title = Field(default="", description="what it is called in tables; its key by default")
    share: Annotated[float, Field(ge=0, le=10), Above("a share has no unit; divide by 100 if in %")] = Field(
        description="share of the seats that is taken; 0.5 is half of them"
    )
    kg: Annotated[float, Field(ge=0, le=500)] | None = Field(
        default=None, description="mass of one passenger [kg]; that of the train if left out"
    )


class CollisionScenario(Part):
    """One collision scenario."""

    title: Title = Field(description="as it heads its rows")
    partner: str = Field(
        description=f"{IDENTICAL}: the same train; rigid_wall; or a partner file by its name, one beside this file, "
        "NAME.partner.yaml, or one that ships"
    )
    speed_km_h: OneSpeed | None = Field(default=None, description="of the train, whatever its category [km/h]")
    speed_by_category_km_h: dict[Category, OneSpeed] = Field(
        default_factory=dict, description="in its place: for each category to which the scenario applies [km/h]"
    )
    ends: Annotated[list[End], Field(min_length=1, max_length=2)] = Field(
        default=["front", "rear"], description="which ends of the train lead"
    )
    limits: dict[Response, Positive | None] = Field(
        default_factory=dict, description="limits of this scenario, over those of all; null for none"
    )
    set: dict[str, Any] = Field(default_factory=dict, description="values of the scenario changed in it, by path")
    notes: Notes = Field(default="", description="what a reader of its rows must know")


class AssessmentFile(Part, title="assessment file"):
    """What a train must pass."""

    title: Title = Field(description="such as the standard after which it is made")
    edition: Title = Field(default="", description="edition, and what is known of it")
    notes: Notes = Field(default="", description="what a reader of the result must know")
    sources: Sources = Field(default_factory=dict, description="where values come from, by path")
    categories: dict[Category, Title] = Field(
        default_factory=dict, max_length=100, description="categories of trains, in words, by name; none by default"
    )
    load_states: dict[Key, LoadState] = Field(
        default_factory=dict, max_length=20, description="load states, by name; the train as it stands if left out"
    )
    scenarios: Annotated[dict[Key, CollisionScenario], Field(min_length=1, max_length=50)] = Field(
        description="collision scenarios, by name"
    )
    limits: dict[Response, Positive] = Field(
        default_factory=dict,
        max_length=100,
        description="largest magnitudes allowed in all scenarios, as under limits of a scenario file",
    )
    reported: Annotated[list[Response], Field(max_length=50)] = Field(
        default_factory=list, description="quantities or responses that are reported beside them and not judged"
    )
    set: dict[str, Any] = Field(default_factory=dict, description="values of the scenario changed in all, by path")
    brakes: bool = Field(default=True, description="whether the brakes of the train act, and those of its twin")
    not_computed: dict[Key, Annotated[str, Field(min_length=1, max_length=1000)]] = Field(
        default_factory=dict, description="what the document asks and no collision here answers, with the reason"
    )
