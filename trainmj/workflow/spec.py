"""The study file as checked parts: what each key may hold, before names are looked up in the scenario.

Names of factors and responses are the user's; a response is a column of :func:`trainmj.run_cases` under a short name.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

MAX_POINTS = 5000
"""Most points of a design: the distances between all of them are held in memory."""

Number = Annotated[float, Field(ge=-1e100, le=1e100, allow_inf_nan=False)]  # sums and squares stay finite
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=40)]
Seed = Annotated[int, Field(ge=0, lt=2**32)]
Title = Annotated[str, Field(max_length=200)]
Notes = Annotated[str, Field(max_length=20_000)]
Resolution = dict[str, Annotated[float, Field(gt=0, allow_inf_nan=False)]]


class Part(BaseModel):
    """A group of the study file: its keys are all known, its values fixed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class FactorPart(Part):
    """What is varied, and which values of the scenario it sets."""

    sets: str | list[str] = Field(description="parameter or path of the scenario, or several that get the same value")
    bounds: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    kind: Literal["continuous", "integer", "choice"] | None = None
    levels: Annotated[list[Any], Field(min_length=2, max_length=1000)] | None = None
    unit: Annotated[str, Field(max_length=20)] | None = Field(
        None, description="by default from the end of the path's name"
    )


class DesignPart(Part):
    """Where to simulate."""

    kind: Literal["optimal_latin_hypercube", "sobol", "full_factorial", "central_composite", "table"] = (
        "optimal_latin_hypercube"
    )
    n: Annotated[int, Field(ge=2, le=MAX_POINTS)] | None = None
    seed: Seed | None = None
    placement: Literal["edge", "centre"] | None = None
    levels: dict[str, Annotated[int, Field(ge=2, le=MAX_POINTS)]] | None = None
    form: Literal["face", "inscribed"] | None = None
    file: str | None = None
    resolution: Resolution = Field(default_factory=dict, description="points are whole multiples of these")


class CorrelationPart(Part):
    """How factors and responses are correlated."""

    methods: Annotated[list[Literal["pearson", "spearman"]], Field(min_length=1)] = ["pearson", "spearman"]
    level: Annotated[float, Field(gt=0, lt=1)] = 0.95


class SurrogatePart(Part):
    """What stands in for the simulation of one response."""

    kind: Literal["polynomial", "kriging"] = "polynomial"
    order: Annotated[int, Field(ge=1, le=6)] | None = None
    terms: Annotated[list[Annotated[str, Field(max_length=200)]], Field(min_length=1, max_length=500)] | None = None
    selection: Literal["none", "press", "bic"] = "none"
    seed: Seed = 0


class CrossValidationPart(Part):
    """Which kinds the chosen surrogates are compared with, all fitted afresh without the points they predict."""

    against: list[Literal["linear", "quadratic", "cubic", "kriging"]] = ["linear", "quadratic"]
    folds: Annotated[int, Field(ge=2, le=MAX_POINTS)] | None = None
    seed: Seed = 0


class ConstraintPart(Part):
    """Limits of one response."""

    at_most: Number | None = None
    at_least: Number | None = None
    margin: Annotated[Number, Field(ge=0)] = Field(
        0.0, description="how far the search on the surrogate stays inside the limits"
    )


class SwarmPart(Part):
    """How wide and how long a swarm searches."""

    particles: Annotated[int, Field(ge=4, le=100_000)]
    iterations: Annotated[int, Field(ge=1, le=100_000)]
    archive: Annotated[int, Field(ge=4, le=5000)]
    patience: Annotated[int, Field(ge=1, le=100_000)]
    tolerance: Annotated[float, Field(ge=0, lt=1)]


class SurrogateSwarm(SwarmPart):
    """A swarm on the surrogates, where a point costs nothing."""

    particles: Annotated[int, Field(ge=4, le=100_000)] = 100
    iterations: Annotated[int, Field(ge=1, le=100_000)] = 250
    archive: Annotated[int, Field(ge=4, le=5000)] = 100
    patience: Annotated[int, Field(ge=1, le=100_000)] = 25
    tolerance: Annotated[float, Field(ge=0, lt=1)] = 1e-4


class SimulatorSwarm(SwarmPart):
    """A swarm on the simulator, where a point costs a collision."""

    particles: Annotated[int, Field(ge=4, le=100_000)] = 32
    iterations: Annotated[int, Field(ge=1, le=100_000)] = 30
    archive: Annotated[int, Field(ge=4, le=5000)] = 60
    patience: Annotated[int, Field(ge=1, le=100_000)] = 8
    tolerance: Annotated[float, Field(ge=0, lt=1)] = 1e-3


class OptimiserPart(Part):
    """Where the front is searched, and how."""

    on: Literal["surrogate", "simulator", "both"] = "surrogate"
    seed: Seed = 0
    resolution: Resolution = Field(default_factory=dict, description="designs are whole multiples of these")
    surrogate: SurrogateSwarm = SurrogateSwarm()
    simulator: SimulatorSwarm = SimulatorSwarm()


class WeightsPart(Part):
    """How much each objective counts."""

    method: Literal["entropy", "equal", "own"] = "entropy"
    form: Literal["paper", "textbook"] | None = None
    data: Literal["raw", "t_score", "min_max"] | None = None
    of: Annotated[Literal["design", "front"] | None, Field(description="whose values the entropy is taken of")] = None
    own: dict[str, Annotated[Number, Field(ge=0)]] | None = None


class DecisionPart(Part):
    """How one design of the front is chosen."""

    method: Literal["weighted_sum", "topsis", "knee"] = "topsis"
    normalisation: Literal["min_max", "max", "sum", "vector", "none"] | None = None
    front: Literal["surrogate", "simulator"] | None = None
    spread: Annotated[float, Field(gt=0, le=2, description="deviation of random weights, as part of each")] = 0.1
    seed: Seed = 0


class CheckPart(Part):
    """How the chosen design is simulated again."""

    set: dict[str, Any] = Field(default_factory=dict, description="values changed for the check, such as a finer step")


class StudyFile(Part):
    """A study file: from a scenario with free values to one chosen and verified design."""

    title: Title = ""
    notes: Notes = ""
    scenario: str = Field(description="scenario file beside this one, or the name of a shipped one")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case")
    factors: Annotated[dict[Name, FactorPart], Field(min_length=1, max_length=20)]
    responses: Annotated[dict[Name, str], Field(min_length=1, max_length=200)]
    design: DesignPart
    correlation: CorrelationPart = CorrelationPart()
    surrogates: dict[str, SurrogatePart] = Field(default_factory=dict, description="by response; default for the rest")
    cross_validation: CrossValidationPart = CrossValidationPart()
    objectives: Annotated[dict[str, Literal["minimise", "maximise"]], Field(min_length=1, max_length=5)]
    constraints: dict[str, ConstraintPart] = Field(default_factory=dict)
    optimiser: OptimiserPart = OptimiserPart()
    weights: WeightsPart = WeightsPart()
    decision: DecisionPart = DecisionPart()
    check: CheckPart = CheckPart()
