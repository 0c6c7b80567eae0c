"""The reliability file as checked parts: scenario, tolerances and load cases, and what is asked of the draws."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from trainmj.cases.load_cases import LoadCases
from trainmj.files.parts import WHOLE, Either, Notes, Part, Seed, Title
from trainmj.files.provenance import Sources
from trainmj.scenario.tolerances import FurtherTolerances

MAX_RUNS = 10_000_000
ANY = "any"
"""What stands for all limits of all load cases: whichever of them is passed."""

Whole = Annotated[int, Field(ge=1, le=MAX_RUNS), WHOLE]
Share = Annotated[float, Field(gt=0, lt=1)]


class Rare(Part):
    """A search for probabilities that are too small for plain draws."""

    limits: Annotated[
        Literal["auto", "any"] | Annotated[list[str], Field(min_length=1, max_length=50)],
        Either(said=f"auto, {ANY}, or a list of limits"),
    ] = Field(
        default="auto",
        description=f"names of limits; {ANY}: whichever is passed in whichever load case; auto: every limit that fewer "
        "than 10 of the plain draws pass",
    )
    method: Literal["subset_simulation", "importance_sampling"] = Field(
        default="subset_simulation",
        description="importance sampling begins with subset simulation, and draws about the passes that this found",
    )
    runs: Annotated[int, Field(ge=100, le=1_000_000), WHOLE] = Field(
        default=1000, description="draws of a level of subset simulation, or of importance sampling"
    )
    levels: Annotated[int, Field(ge=1, le=20), WHOLE] = Field(
        default=6, description="levels after which it gives up, each a tenth as probable as the one before"
    )


class Sensitivity(Part):
    """Sobol' indices: which tolerance the scatter comes from, and which one it would pay to tighten."""

    responses: Annotated[list[str], Field(max_length=50)] = Field(
        default_factory=list,
        description="names or patterns, besides how much is used of the limit that is most likely to be passed",
    )
    runs: Annotated[int, Field(ge=16, le=1_000_000), WHOLE] = Field(
        default=256, description="base draws; each costs two collisions and one more for each tolerance, in every case"
    )


class ReliabilityFile(Part, title="reliability file"):
    """How likely limits are passed under tolerances."""

    title: Title = Field(default="", description="one line that heads every output")
    notes: Notes = Field(default="", description="such as where the tolerances come from")
    sources: Sources = Field(default_factory=dict, description="where values come from, by path")
    scenario: str = Field(description="scenario file beside this one, or the name of a shipped one")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case")
    tolerances: FurtherTolerances = Field(default_factory=dict)
    cases: LoadCases | None = Field(
        default=None, description="load cases: the same train as built is collided in each; one if left out"
    )
    runs: Whole = Field(default=1000, description="draws; more may be asked for later")
    seed: Seed = Field(default=0, description="of the random numbers")
    draws: Literal["sobol", "random", "latin_hypercube"] = Field(
        default="sobol",
        description="scrambled Sobol' points, independent random ones, or Latin hypercubes of 100 each",
    )
    responses: Annotated[list[str], Field(max_length=200)] = Field(
        default=["TS_mm", "TAMA_g"],
        description="names or patterns of responses of which quantiles are told, besides what is limited",
    )
    quantiles: Annotated[list[Share], Field(max_length=20)] = Field(
        default=[0.05, 0.5, 0.95, 0.99], description="between 0 and 1: 0.95 is the value that 5 % exceed"
    )
    level: Share = Field(default=0.95, description="confidence level of all intervals")
    rare: Rare | None = Field(default=None, description="search for small probabilities; none by default")
    sensitivity: Sensitivity | None = Field(default=None, description="Sobol' indices; none by default")
