"""The study file as checked parts: what each key may hold, before names are looked up in the scenario.

Names of factors and responses are the user's; a response is a column of :func:`trainmj.run_cases` under a short name.
Where there are several kinds of a thing, each kind is a part with just its keys.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from trainmj.cases.load_cases import LoadCase
from trainmj.doe.decision import Normalisation
from trainmj.doe.weights import Transform
from trainmj.files.parts import WHOLE, Bounds, Either, Name, Notes, Number, Part, Positive, Seed, Title
from trainmj.files.tables import TablePlace
from trainmj.scenario.tolerances import FurtherTolerances
from trainmj.units import unit_of

MAX_POINTS = 5000
"""Most points of a design: the distances between all of them are held in memory."""

Resolution = dict[str, Annotated[float, Field(gt=0, allow_inf_nan=False)]]


class _Factor(Part):
    sets: Annotated[str | Annotated[list[str], Field(min_length=1)], Either()] = Field(
        description="parameter or path of the scenario, or several that get the same value"
    )
    unit: Annotated[str, Field(max_length=20)] | None = Field(
        default=None, description="by default from the end of the path's name"
    )

    @property
    def targets(self) -> tuple[str, ...]:
        """The parameters and paths that the factor sets."""
        return (self.sets,) if isinstance(self.sets, str) else tuple(self.sets)

    @property
    def stated_unit(self) -> str:
        """The unit that is stated, or that of the first target's name."""
        return unit_of(self.targets[0]) if self.unit is None else self.unit


class _Bounded(_Factor):
    bounds: Bounds = Field(description="lowest and highest value")


class ContinuousFactor(_Bounded):
    """A value that is varied between bounds."""

    kind: Literal["continuous"] = "continuous"


class IntegerFactor(_Bounded):
    """A whole number that is varied between bounds."""

    kind: Literal["integer"]


class ChoiceFactor(_Factor):
    """A value that is chosen from several."""

    kind: Literal["choice"] = "choice"
    levels: Annotated[list[str | bool | int | float], Field(min_length=2, max_length=1000)] = Field(
        description="values to choose from: numbers or text"
    )


FactorPart = Annotated[ContinuousFactor | IntegerFactor | ChoiceFactor, Either(by="kind")]


class _Design(Part):
    resolution: Resolution = Field(default_factory=dict, description="points are whole multiples of these, by factor")


class LatinHypercube(_Design):
    """Points as far apart as possible, each with a level of its own in every factor."""

    kind: Literal["optimal_latin_hypercube"] = "optimal_latin_hypercube"
    n: Annotated[int, Field(ge=2, le=300), WHOLE] = Field(description="points; a sobol design takes more")
    seed: Seed = Field(default=0, description="of the search for the best spread")
    placement: Literal["edge", "centre"] = Field(
        default="edge", description="do the outer points lie on the bounds or inside?"
    )


class SobolSequence(_Design):
    """Points of a scrambled Sobol' sequence; a power of two is spread best."""

    kind: Literal["sobol"]
    n: Annotated[int, Field(ge=2, le=MAX_POINTS), WHOLE] = Field(description="points")
    seed: Seed = Field(default=0, description="of the scrambling")


class FullFactorial(_Design):
    """Every combination of the levels of all factors."""

    kind: Literal["full_factorial"]
    levels: dict[str, Annotated[int, Field(ge=2, le=MAX_POINTS), WHOLE]] = Field(
        default_factory=dict, description="how many, by factor; required for a continuous one without a resolution"
    )


class CentralComposite(_Design):
    """Corners, axis points and the centre, within the bounds."""

    kind: Literal["central_composite"]
    form: Literal["face", "inscribed"] = Field(
        default="face", description="corners on the bounds, or drawn in so that all points lie on a sphere"
    )


class GivenPoints(TablePlace):
    """Points from a file, with a column for each factor."""

    kind: Literal["table"]


DesignPart = Annotated[
    LatinHypercube | SobolSequence | FullFactorial | CentralComposite | GivenPoints, Either(by="kind")
]


class CorrelationPart(Part):
    """How factors and responses are correlated."""

    methods: Annotated[list[Literal["pearson", "spearman"]], Field(min_length=1)] = Field(
        default=["pearson", "spearman"], description="of values, or of ranks"
    )
    level: Annotated[float, Field(gt=0, lt=1)] = Field(default=0.95, description="of the confidence intervals")


class _Polynomial(Part):
    kind: Literal["polynomial"] = "polynomial"
    selection: Literal["none", "press", "bic"] = Field(
        default="none", description="criterion by which terms that do not help are dropped"
    )


class FullPolynomial(_Polynomial):
    """A polynomial with all terms up to an order."""

    order: Annotated[int, Field(ge=1, le=6), WHOLE] = Field(default=2, description="highest order of a term")


class PolynomialOfTerms(_Polynomial):
    """A polynomial with the terms that are listed."""

    terms: Annotated[list[Annotated[str, Field(max_length=200)]], Field(min_length=1, max_length=500)] = Field(
        description='such as "1", D, D^2 and D*M'
    )


class KrigingPart(Part):
    """A Gaussian process; needs pip install 'trainmj[kriging]'."""

    kind: Literal["kriging"]
    seed: Seed = Field(default=0, description="of the search for the lengths")


SurrogatePart = Annotated[FullPolynomial | PolynomialOfTerms | KrigingPart, Either(by="kind")]


class CrossValidationPart(Part):
    """Which kinds the chosen surrogates are compared with, all fitted afresh without the points they predict."""

    against: list[Literal["linear", "quadratic", "cubic", "kriging"]] = Field(
        default=["linear", "quadratic"], description="kinds compared with"
    )
    folds: Annotated[int, Field(ge=2, le=MAX_POINTS), WHOLE] | None = Field(
        default=None, description="parts that the points are dealt into; by default as many as points"
    )
    seed: Seed = Field(default=0, description="of the dealing")


class ConstraintPart(Part):
    """Limits of one response."""

    at_most: Number | None = Field(default=None, description="upper limit, in the unit of the response")
    at_least: Number | None = Field(default=None, description="lower limit")
    margin: Annotated[Number, Field(ge=0)] = Field(
        default=0.0, description="how far inside the limits the search on the surrogates stays"
    )


Particles = Annotated[int, Field(ge=4, le=100_000, description="designs that move at once"), WHOLE]
Iterations = Annotated[int, Field(ge=1, le=100_000, description="moves at most"), WHOLE]
Archive = Annotated[int, Field(ge=4, le=5000, description="most designs of the front that are kept"), WHOLE]
Patience = Annotated[int, Field(ge=1, le=100_000, description="moves without progress after which it ends"), WHOLE]
Growth = Annotated[float, Field(ge=0, lt=1, description="growth of the hypervolume that counts as progress")]


class SurrogateSwarm(Part):
    """A swarm on the surrogates, where a point costs nothing."""

    particles: Particles = 100
    iterations: Iterations = 250
    archive: Archive = 100
    patience: Patience = 25
    tolerance: Growth = 1e-4


class SimulatorSwarm(Part):
    """A swarm on the simulator, where a point costs a collision."""

    particles: Particles = 32
    iterations: Iterations = 30
    archive: Archive = 60
    patience: Patience = 8
    tolerance: Growth = 1e-3


class OptimiserPart(Part):
    """Where the front is searched, and how."""

    on: Literal["surrogate", "simulator", "both"] = Field(default="surrogate", description="what is searched")
    seed: Seed = Field(default=0, description="of the swarms")
    resolution: Resolution = Field(default_factory=dict, description="designs are whole multiples of these, by factor")
    surrogate: SurrogateSwarm = Field(default=SurrogateSwarm(), description="the swarm on the surrogates")
    simulator: SimulatorSwarm = Field(default=SimulatorSwarm(), description="the swarm on the simulator")


class EntropyWeights(Part):
    """The more unevenly its values are spread, the more an objective counts."""

    method: Literal["entropy"] = "entropy"
    normalised: bool = Field(
        default=True,
        description="are entropies divided by ln(n), their largest value? If not, the weights are nearly equal and "
        "favour the objective that varies less",
    )
    data: Transform = Field(default="raw", description="how values are scaled before")
    of: Literal["design", "front"] = Field(default="design", description="whose values the entropy is taken of")


class EqualWeights(Part):
    """Every objective counts the same."""

    method: Literal["equal"]


class OwnWeights(Part):
    """Weights of your own."""

    method: Literal["own"]
    own: dict[str, Annotated[Number, Field(ge=0)]] = Field(description="by objective; scaled to add up to 1")


WeightsPart = Annotated[EntropyWeights | EqualWeights | OwnWeights, Either(by="method")]


class _Decision(Part):
    front: Literal["surrogate", "simulator"] | None = Field(
        default=None, description="the front that is chosen from; by default the surrogates' if it is searched"
    )


class _Weighted(_Decision):
    spread: Annotated[float, Field(gt=0, le=2)] = Field(
        default=0.1, description="deviation of the random weights that the choice is tried with, as part of each"
    )
    seed: Seed = Field(default=0, description="of the random weights")


class WeightedSum(_Weighted):
    """The design with the smallest weighted sum of its objectives."""

    method: Literal["weighted_sum"]
    normalisation: Normalisation = Field(default="min_max", description="of the objectives")


class Topsis(_Weighted):
    """The design close to the best and far from the worst value of each objective."""

    method: Literal["topsis"] = "topsis"
    normalisation: Normalisation = Field(default="vector", description="of the objectives")


class KneePoint(_Decision):
    """The design where giving up a little of one objective stops gaining much of another; needs no weights."""

    method: Literal["knee"]


DecisionPart = Annotated[WeightedSum | Topsis | KneePoint, Either(by="method")]


class ResponsePart(Part):
    """A response of some load cases only."""

    column: str = Field(description="column of the results")
    cases: Annotated[list[Name], Field(min_length=1)] = Field(description="load cases in which it is asked")


class StudyCase(LoadCase):
    """A load case with limits of its own."""

    constraints: dict[str, ConstraintPart] = Field(
        default_factory=dict, description="limits in this case, by response, in place of those of all cases"
    )


class CheckPart(Part):
    """How the chosen design is simulated again."""

    set: dict[str, Any] = Field(default_factory=dict, description="values changed for the check, such as a finer step")


Share = Annotated[float, Field(ge=0, le=1)]
Percent = Annotated[float, Field(ge=0, le=100)]


class QualityPart(Part):
    """What a study asks of itself before it is trusted."""

    least_r2: Share = Field(default=0.8, description="R² of points left out, below which a surrogate is poor")
    largest_error_percent: Percent = Field(
        default=10.0,
        description="error of a prediction that the check may find, of the response's range over the design",
    )
    negligible_percent: Percent = Field(
        default=0.5,
        description="of a response's largest value: a range below it is none, and an error below it is no fault",
    )
    strong_correlation: Share = Field(
        default=0.5, description="|r| of a factor and a response from which a surrogate must have the factor"
    )
    confounding_correlation: Share = Field(
        default=0.3, description="|r| of two factors in the design above which their effects cannot be told apart"
    )


class AtQuantile(Part):
    """A quantile over many trains as built."""

    quantile: Annotated[float, Field(gt=0, lt=1)] = Field(
        description="between 0 and 1; 0.95 is the value that 5 % of the trains exceed"
    )


class MeanAndSigmas(Part):
    """The mean over many trains as built, and some standard deviations towards what is worse."""

    sigmas: Positive = Field(description="how many standard deviations")


StatisticPart = Annotated[
    Literal["mean"] | AtQuantile | MeanAndSigmas, Either(said="mean, or a group with quantile or with sigmas")
]
Probability = Annotated[float, Field(gt=0, lt=0.5)]


class RobustPart(Part):
    """A second search for designs that hold under the tolerances of the scenario: many trains as built of each."""

    draws: Annotated[int, Field(ge=16, le=100_000), WHOLE] = Field(
        default=256, description="trains as built of each design; a multiple of 8 times a power of two is spread best"
    )
    seed: Seed = Field(default=0, description="of the trains as built; every design has the same draws")
    objectives: dict[str, StatisticPart] = Field(
        default_factory=dict, description="what of each objective is minimised or maximised; the mean by default"
    )
    probability: Probability = Field(
        default=0.01, description="share of the trains as built that may pass a limit, at most; of each limit"
    )
    probabilities: dict[str, Probability] = Field(default_factory=dict, description="other ones, by response")
    on: Literal["surrogate", "simulator", "both"] = Field(
        default="surrogate",
        description="what is searched: surrogates of the statistics, or the simulator, each point of which costs as "
        "many collisions as there are draws",
    )
    also: dict[Name, dict[str, Any]] = Field(
        default_factory=dict,
        max_length=10,
        description="further designs that are checked in the same way, such as today's: values of all factors, by name",
    )
    check_draws: Annotated[int, Field(ge=100, le=1_000_000), WHOLE] = Field(
        default=10_000, description="trains as built of the chosen designs, by which they are checked"
    )


class StudyFile(Part, title="study file"):
    """A study file: from a scenario with free values to one chosen and verified design."""

    title: Title = Field(default="", description="one line that heads every output")
    notes: Notes = Field(default="", description="where the numbers come from, for example")
    scenario: str = Field(description="scenario file beside this one, or the name of a shipped one")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case")
    factors: Annotated[dict[Name, FactorPart], Field(min_length=1, max_length=20, description="what is varied")]
    responses: Annotated[
        dict[Name, Annotated[str | ResponsePart, Either()]],
        Field(min_length=1, max_length=200, description="short name: column of the results, of every load case"),
    ]
    cases: Annotated[dict[Name, StudyCase], Field(min_length=1, max_length=20)] | None = Field(
        default=None,
        description="load cases that one design must pass, by name; an objective is then the worst of all cases",
    )
    design: DesignPart = Field(description="where to simulate")
    correlation: CorrelationPart = Field(
        default=CorrelationPart(), description="how factors and responses are correlated"
    )
    surrogates: dict[str, SurrogatePart] = Field(
        default_factory=dict, description="what stands in for the simulation, by response; default for the rest"
    )
    cross_validation: CrossValidationPart = Field(
        default=CrossValidationPart(), description="what the surrogates are compared with"
    )
    objectives: Annotated[
        dict[str, Literal["minimise", "maximise"]],
        Field(min_length=1, max_length=5, description="responses to minimise or maximise"),
    ]
    constraints: dict[str, ConstraintPart] = Field(default_factory=dict, description="limits, by response")
    optimiser: OptimiserPart = Field(default=OptimiserPart(), description="where the front is searched, and how")
    weights: WeightsPart = Field(default=EntropyWeights(), description="how much each objective counts")
    decision: DecisionPart = Field(default=Topsis(), description="how one design of the front is chosen")
    check: CheckPart = Field(default=CheckPart(), description="how the chosen design is simulated again")
    tolerances: FurtherTolerances = Field(default_factory=dict)
    robust: RobustPart | None = Field(
        default=None, description="search for designs that hold under the tolerances, beside the nominal one"
    )
    quality: QualityPart = Field(default=QualityPart(), description="what is asked of a study before it is trusted")

    def column(self, response: str) -> str:
        """The column of the results that a response is."""
        part = self.responses[response]
        return part if isinstance(part, str) else part.column

    def cases_of(self, response: str) -> list[str]:
        """The load cases in which a response is asked; one without a name, "", if there are none."""
        part = self.responses[response]
        return list(self.cases or [""]) if isinstance(part, str) else part.cases

    def constraints_in(self, case: str) -> dict[str, ConstraintPart]:
        """The limits in a load case, by response."""
        return self.constraints | (self.cases[case].constraints if self.cases and case else {})


def name_in(response: str, case: str) -> str:
    """The name of a response in a load case, under which the study's tables have it."""
    return f"{response}_{case}" if case else response
