"""Tolerances of a scenario: what scatters from train to train, by which distribution, and which parts scatter alike."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from trainmj.files.parts import Above, Bounds, Either, Name, Number, Part, Positive
from trainmj.files.source import Path, Problem, no_such

Percent = Annotated[
    float,
    Field(gt=0, le=100, allow_inf_nan=False),
    Above("a tolerance of more than 100 % would reach below zero: state sigma or range"),
]
_SPREADS = ("sigma", "percent", "range")


class _Tolerance(Part):
    kind: str
    of: Annotated[str | Annotated[list[str], Field(min_length=1, max_length=100)], Either()] = Field(
        description="parameter or path of the value that scatters, or several that scatter together"
    )
    scales: Literal["force", "stroke"] | None = Field(
        default=None,
        description="the paths lead to curves, or to devices or stages with curves, whose forces or strokes are "
        "multiplied by a factor that scatters around 1; forces include those of shear bolts",
    )
    copies: Literal["independent", "same"] | None = Field(
        default=None,
        description="where several vehicles or devices have the value: has each of them a draw of its own, or all one? "
        "Compulsory there",
    )
    correlated: dict[Name, Annotated[float, Field(gt=-1, lt=1, allow_inf_nan=False)]] = Field(
        default_factory=dict,
        description="coefficient of correlation with other tolerances, by their names; of the normal scores, which for "
        "normal distributions are the values",
    )

    @property
    def targets(self) -> tuple[str, ...]:
        """The parameters and paths that scatter."""
        return (self.of,) if isinstance(self.of, str) else tuple(self.of)

    @property
    def own_values(self) -> bool:
        """Whether it says what is drawn whatever value stands there, not by how much that scatters."""
        whole = ("mean", "range") if self.kind in ("normal", "lognormal", "uniform") else ("mean", "values")
        return self.scales is None and any(getattr(self, key, None) is not None for key in whole)


class _Spread(_Tolerance):
    """A distribution around a mean."""

    mean: Number | None = Field(
        default=None, description="of the distribution; by default the value in the scenario, or the factor 1"
    )
    sigma: Positive | None = Field(default=None, description="standard deviation, in the unit of the value")
    percent: Percent | None = Field(default=None, description="standard deviation in % of the mean")


class Normal(_Spread):
    """Scatters around a mean; range is what 99.73 % lie in, the mean in its middle."""

    kind: Literal["normal"] = "normal"
    range: Bounds | None = Field(default=None, description="mean - 3 sigma and mean + 3 sigma")


class TruncatedNormal(_Spread):
    """A normal distribution of which nothing lies outside its range: what inspection lets pass."""

    kind: Literal["truncated_normal"]
    range: Bounds | None = Field(default=None, description="what is outside is never drawn")
    cut_sigma: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] | None = Field(
        default=None, description="in place of range: it reaches as many sigma to both sides of the mean"
    )


class Uniform(_Tolerance):
    """Any value within a range is equally likely."""

    kind: Literal["uniform"]
    range: Bounds | None = Field(default=None, description="lowest and highest value")
    percent: Percent | None = Field(default=None, description="in its place: to both sides of the value, in % of it")


class Lognormal(_Spread):
    """The logarithm is normal: never below zero, with a tail to large values."""

    kind: Literal["lognormal"]
    range: Bounds | None = Field(default=None, description="what 99.73 % lie in, as many below it as above")


class Discrete(_Tolerance):
    """One of several values."""

    kind: Literal["discrete"]
    values: Annotated[list[Any], Field(min_length=2, max_length=1000)] = Field(description="values to draw from")
    probabilities: Annotated[list[Annotated[float, Field(gt=0, le=1)]], Field(min_length=2)] | None = Field(
        default=None, description="of each value, adding up to 1; equally likely if left out"
    )


Tolerance = Annotated[Normal | TruncatedNormal | Uniform | Lognormal | Discrete, Either(by="kind")]
Tolerances = Annotated[dict[Name, Tolerance], Field(max_length=200)]
FurtherTolerances = Annotated[
    dict[Name, Tolerance | None],
    Field(
        max_length=200,
        description="what scatters from train to train, by a name each, over those of the scenario; null takes one out",
    ),
]


def tolerance_rules(at: Path, tolerances: dict[str, Tolerance]) -> Iterator[Problem]:
    """Rules of tolerances: how each is spread, and what it is correlated with."""
    for name, tolerance in tolerances.items():
        path = (*at, name)
        yield from _spread(path, tolerance)
        for other in tolerance.correlated:
            if other == name:
                yield Problem((*path, "correlated", other), "is the tolerance itself")
            elif other not in tolerances:
                yield no_such("tolerance", (*path, "correlated", other), other, tolerances)
            elif name in tolerances[other].correlated:
                yield Problem((*path, "correlated", other), f"is stated of {other} too: leave one of them out")


def _spread(path: Path, tolerance: Tolerance) -> Iterator[Problem]:
    if isinstance(tolerance, Discrete):
        n, probabilities = len(tolerance.values), tolerance.probabilities
        if tolerance.scales and not all(isinstance(v, int | float) and v > 0 for v in tolerance.values):
            yield Problem((*path, "values"), "must be factors above 0, since it scales curves")
        if probabilities is not None and (len(probabilities) != n or abs(sum(probabilities) - 1.0) > 1e-9):
            rule = f"must be one for each of the {n} values, adding up to 1"
            yield Problem((*path, "probabilities"), f"{rule}; they are {len(probabilities)}, {sum(probabilities):.12g}")
        return
    stated = [key for key in _SPREADS if getattr(tolerance, key, None) is not None]
    offered = [key for key in _SPREADS if hasattr(tolerance, key)]
    if isinstance(tolerance, TruncatedNormal):
        if len(set(stated) & {"sigma", "percent"}) != 1:
            yield Problem(path, "needs sigma or percent, one of them")
        if (tolerance.range is None) == (tolerance.cut_sigma is None):
            yield Problem(path, "needs range or cut_sigma, one of them: where it is cut")
    elif len(stated) != 1:
        yield Problem(
            path, f"needs one of {', '.join(offered)}" + (f", and has {' and '.join(stated)}" if stated else "")
        )
    range_ = tolerance.range
    if range_ is not None and (isinstance(tolerance, Lognormal) or tolerance.scales) and range_[0] <= 0:
        what = "factors" if tolerance.scales else "values of a lognormal distribution"
        yield Problem((*path, "range"), f"must be above 0: {what} are")
    if "range" in stated and isinstance(tolerance, Normal | Lognormal) and tolerance.mean is not None:
        yield Problem(
            (*path, "mean"), "does not go with range, which has the mean in its middle: leave one of them out"
        )
