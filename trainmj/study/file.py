"""The study file as checked parts: what each key may hold, before names are looked up in the scenario.

Names of factors and responses are the user's; a response is a column of :func:`trainmj.run_cases` under a short name.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from trainmj.files.parts import Name, Notes, Number, Part, Seed, Title

MAX_POINTS = 5000
"""Most points of a design: the distances between all of them are held in memory."""

Resolution = dict[str, Annotated[float, Field(gt=0, allow_inf_nan=False)]]


class FactorPart(Part):
    """What is varied, and which values of the scenario it sets."""

    sets: str | list[str] = Field(description="parameter or path of the scenario, or several that get the same value")
    bounds: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="lowest and highest value"
    )
    kind: Literal["continuous", "integer", "choice"] | None = Field(
        default=None, description="by default a choice if it has levels, else continuous"
    )
    levels: Annotated[list[Any], Field(min_length=2, max_length=1000)] | None = Field(
        default=None, description="values to choose from, instead of bounds"
    )
    unit: Annotated[str, Field(max_length=20)] | None = Field(
        default=None, description="by default from the end of the path's name"
    )


class DesignPart(Part):
    """Where to simulate."""

    kind: Literal["optimal_latin_hypercube", "sobol", "full_factorial", "central_composite", "table"] = Field(
        default="optimal_latin_hypercube", description="how the points are spread over the factors"
    )
    n: Annotated[int, Field(ge=2, le=MAX_POINTS)] | None = Field(
        default=None, description="points of a Latin hypercube or Sobol' sequence"
    )
    seed: Seed | None = Field(default=None, description="of a Latin hypercube or Sobol' sequence")
    placement: Literal["edge", "centre"] | None = Field(
        default=None, description="do the outer points of a Latin hypercube lie on the bounds or inside?"
    )
    levels: dict[str, Annotated[int, Field(ge=2, le=MAX_POINTS)]] | None = Field(
        default=None, description="levels of a full factorial, by factor"
    )
    form: Literal["face", "inscribed"] | None = Field(
        default=None,
        description="of a central composite: corners on the bounds, or drawn in so that all points lie on a sphere",
    )
    file: str | None = Field(default=None, description="CSV file of a table, a column for each factor")
    resolution: Resolution = Field(default_factory=dict, description="points are whole multiples of these")


class CorrelationPart(Part):
    """How factors and responses are correlated."""

    methods: Annotated[list[Literal["pearson", "spearman"]], Field(min_length=1)] = Field(
        default=["pearson", "spearman"], description="of values, or of ranks"
    )
    level: Annotated[float, Field(gt=0, lt=1)] = Field(default=0.95, description="of the confidence intervals")


class SurrogatePart(Part):
    """What stands in for the simulation of one response."""

    kind: Literal["polynomial", "kriging"] = Field(
        default="polynomial", description="kriging needs pip install 'trainmj[kriging]'"
    )
    order: Annotated[int, Field(ge=1, le=6)] | None = Field(default=None, description="of a polynomial")
    terms: Annotated[list[Annotated[str, Field(max_length=200)]], Field(min_length=1, max_length=500)] | None = Field(
        default=None, description="terms of a polynomial, such as D^2 and D*M, instead of its order"
    )
    selection: Literal["none", "press", "bic"] = Field(
        default="none", description="by what terms that do not help are dropped"
    )
    seed: Seed = Field(default=0, description="of the search for kriging's lengths")


class CrossValidationPart(Part):
    """Which kinds the chosen surrogates are compared with, all fitted afresh without the points they predict."""

    against: list[Literal["linear", "quadratic", "cubic", "kriging"]] = Field(
        default=["linear", "quadratic"], description="kinds compared with"
    )
    folds: Annotated[int, Field(ge=2, le=MAX_POINTS)] | None = Field(
        default=None, description="parts that the points are dealt into; by default as many as points"
    )
    seed: Seed = Field(default=0, description="of the dealing")


class ConstraintPart(Part):
    """Limits of one response."""

    at_most: Number | None = Field(default=None, description="upper limit, in the unit of the response")
    at_least: Number | None = Field(default=None, description="lower limit")
    margin: Annotated[Number, Field(ge=0)] = Field(
        default=0.0, description="how far the search on the surrogate stays inside the limits"
    )


Particles = Annotated[int, Field(ge=4, le=100_000, description="designs that move at once")]
Iterations = Annotated[int, Field(ge=1, le=100_000, description="moves at most")]
Archive = Annotated[int, Field(ge=4, le=5000, description="most designs of the front that are kept")]
Patience = Annotated[int, Field(ge=1, le=100_000, description="moves without progress after which it ends")]
Tolerance = Annotated[float, Field(ge=0, lt=1, description="growth of the hypervolume that counts as progress")]


class SurrogateSwarm(Part):
    """A swarm on the surrogates, where a point costs nothing."""

    particles: Particles = 100
    iterations: Iterations = 250
    archive: Archive = 100
    patience: Patience = 25
    tolerance: Tolerance = 1e-4


class SimulatorSwarm(Part):
    """A swarm on the simulator, where a point costs a collision."""

    particles: Particles = 32
    iterations: Iterations = 30
    archive: Archive = 60
    patience: Patience = 8
    tolerance: Tolerance = 1e-3


class OptimiserPart(Part):
    """Where the front is searched, and how."""

    on: Literal["surrogate", "simulator", "both"] = Field(default="surrogate", description="what is searched")
    seed: Seed = Field(default=0, description="of the swarms")
    resolution: Resolution = Field(default_factory=dict, description="designs are whole multiples of these")
    surrogate: SurrogateSwarm = Field(default=SurrogateSwarm(), description="the swarm on the surrogates")
    simulator: SimulatorSwarm = Field(default=SimulatorSwarm(), description="the swarm on the simulator")


class WeightsPart(Part):
    """How much each objective counts."""

    method: Literal["entropy", "equal", "own"] = Field(default="entropy", description="where the weights come from")
    form: Literal["paper", "textbook"] | None = Field(
        default=None, description="of entropy: as in the paper, or with 1/ln(n)"
    )
    data: Literal["raw", "t_score", "min_max"] | None = Field(
        default=None, description="how values are scaled for entropy"
    )
    of: Annotated[Literal["design", "front"] | None, Field(description="whose values the entropy is taken of")] = None
    own: dict[str, Annotated[Number, Field(ge=0)]] | None = Field(default=None, description="own weights, by objective")


class DecisionPart(Part):
    """How one design of the front is chosen."""

    method: Literal["weighted_sum", "topsis", "knee"] = Field(
        default="topsis", description="by what designs are ranked"
    )
    normalisation: Literal["min_max", "max", "sum", "vector", "none"] | None = Field(
        default=None, description="of the objectives in a weighted sum"
    )
    front: Literal["surrogate", "simulator"] | None = Field(default=None, description="the front that is chosen from")
    spread: Annotated[float, Field(gt=0, le=2, description="deviation of random weights, as part of each")] = 0.1
    seed: Seed = Field(default=0, description="of the random weights")


class CheckPart(Part):
    """How the chosen design is simulated again."""

    set: dict[str, Any] = Field(default_factory=dict, description="values changed for the check, such as a finer step")


class StudyFile(Part):
    """A study file: from a scenario with free values to one chosen and verified design."""

    title: Title = Field(default="", description="one line that heads every output")
    notes: Notes = Field(default="", description="where the numbers come from, and the like")
    scenario: str = Field(description="scenario file beside this one, or the name of a shipped one")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case")
    factors: Annotated[dict[Name, FactorPart], Field(min_length=1, max_length=20, description="what is varied")]
    responses: Annotated[
        dict[Name, str], Field(min_length=1, max_length=200, description="short name: column of the results")
    ]
    design: DesignPart = Field(description="where to simulate")
    correlation: CorrelationPart = Field(
        default=CorrelationPart(), description="how factors and responses are correlated"
    )
    surrogates: dict[str, SurrogatePart] = Field(default_factory=dict, description="by response; default for the rest")
    cross_validation: CrossValidationPart = Field(
        default=CrossValidationPart(), description="what the surrogates are compared with"
    )
    objectives: Annotated[
        dict[str, Literal["minimise", "maximise"]],
        Field(min_length=1, max_length=5, description="responses to minimise or maximise"),
    ]
    constraints: dict[str, ConstraintPart] = Field(default_factory=dict, description="limits, by response")
    optimiser: OptimiserPart = Field(default=OptimiserPart(), description="where the front is searched, and how")
    weights: WeightsPart = Field(default=WeightsPart(), description="how much each objective counts")
    decision: DecisionPart = Field(default=DecisionPart(), description="how one design of the front is chosen")
    check: CheckPart = Field(default=CheckPart(), description="how the chosen design is simulated again")
