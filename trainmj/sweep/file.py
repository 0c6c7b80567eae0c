"""The sweep file as checked parts: what each key may hold."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from trainmj.cases.load_cases import LoadCase, LoadCases
from trainmj.files.parts import WHOLE, Bounds, Either, Number, Part
from trainmj.files.source import Problem
from trainmj.files.tables import OneTable, TablePlace

MAX_VALUES = 1_000_000
"""Largest number of values of a name, and of cells of a sample or table; they are held in memory."""


class Span(Part):
    """Evenly spaced values, both ends included."""

    start: Annotated[Number, Field(alias="from", description="first value")]
    to: Number = Field(description="last value")
    count: Annotated[int, Field(ge=2, le=MAX_VALUES, description="how many"), WHOLE]

    def values(self) -> list[float]:
        """The values."""
        return [float(v) for v in np.linspace(self.start, self.to, self.count)]


class Uniform(Part):
    """A value that scatters evenly between two bounds."""

    uniform: Bounds = Field(description="lowest and highest value")

    def at(self, quantile: NDArray[np.float64]) -> list[Any]:
        """Values at quantiles (n,) between 0 and 1."""
        low, high = self.uniform
        return [float(v) for v in low + (high - low) * quantile]


class Normal(Part):
    """A value that scatters around a mean."""

    normal: Annotated[list[Number], Field(min_length=2, max_length=2)] = Field(
        description="mean and standard deviation"
    )

    def at(self, quantile: NDArray[np.float64]) -> list[Any]:
        """Values at quantiles (n,) between 0 and 1."""
        from scipy.special import ndtri

        mean, deviation = self.normal
        return [float(v) for v in mean + deviation * ndtri(np.clip(quantile, 1e-12, 1 - 1e-12))]


class Choice(Part):
    """One of several values, equally likely."""

    choice: Annotated[list[Any], Field(min_length=1)] = Field(description="values, equally likely")

    def at(self, quantile: NDArray[np.float64]) -> list[Any]:
        """Values at quantiles (n,) between 0 and 1."""
        return [self.choice[min(int(q * len(self.choice)), len(self.choice) - 1)] for q in quantile]


Distribution = Annotated[Uniform | Normal | Choice, Either()]


class Sample(Part):
    """A random or designed sample of several values."""

    count: Annotated[int, Field(ge=1, le=MAX_VALUES, description="how many cases"), WHOLE]
    seed: Annotated[int, Field(ge=0), WHOLE] = Field(default=0, description="of the random numbers")
    method: Literal["random", "latin_hypercube", "sobol"] = Field(
        default="random", description="how the points are spread"
    )
    factors: Annotated[dict[str, Distribution], Field(min_length=1)] = Field(
        description="how each value scatters, by parameter or path"
    )

    def columns(self) -> dict[str, list[Any]]:
        """Values by name, count of each; the same for the same seed."""
        d = len(self.factors)
        if self.method == "random":
            quantiles = np.random.default_rng(self.seed).random((self.count, d))
        else:
            from scipy.stats import qmc

            if self.method == "sobol":
                quantiles = qmc.Sobol(d, rng=self.seed).random_base2(math.ceil(math.log2(self.count)))[: self.count]
            else:
                quantiles = qmc.LatinHypercube(d, rng=self.seed).random(self.count)
        return {name: f.at(quantiles[:, k]) for k, (name, f) in enumerate(self.factors.items())}


Values = Annotated[
    str | Annotated[list[Any], Field(min_length=1)] | Span,
    Either(said="a list, FROM:TO:COUNT, or a group of from, to and count"),
]


class SweepFile(Part, title="sweep file"):
    """A sweep file: the scenario, what is changed in every case, load cases, and what is varied; all is combined."""

    scenario: str = Field(description="scenario file beside this one, or the name of a shipped one")
    set: dict[str, Any] = Field(default_factory=dict, description="values changed in every case")
    cases: Annotated[str | LoadCases, Either(said="load cases by name, or the name of a file")] | None = Field(
        default=None,
        description="load cases by name: other scenarios, or other values; or a file, as table",
    )
    vary: dict[str, Values] = Field(default_factory=dict, description="full grid of these values")
    together: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(
        default_factory=dict, description="lists of equal length that vary together"
    )
    table: OneTable | None = Field(
        default=None, description="CSV file or workbook beside this one: a row for each case, a column for each value"
    )
    sample: Sample | None = Field(default=None, description="random or designed sample of several values")
    responses: Annotated[list[str], Field(min_length=1)] = Field(
        default=["*"], description="columns wanted; * stands for any characters"
    )
    histories: list[Annotated[int, Field(ge=0), WHOLE]] = Field(
        default_factory=list, description="numbers of the cases whose histories are kept, as NetCDF files"
    )

    def table_at(self) -> tuple[str, str | TablePlace] | None:
        """The key that names a file with a table, and where that is."""
        if isinstance(self.cases, str):
            return "cases", self.cases
        return None if self.table is None else ("table", self.table)

    def load_cases(self) -> dict[str, LoadCase]:
        """The load cases by name."""
        return self.cases if isinstance(self.cases, dict) else {}


def broken_rules(spec: SweepFile) -> Iterator[Problem]:
    """Every rule between keys that is broken."""
    if isinstance(spec.cases, str) and spec.table is not None:
        yield Problem(("cases",), "is a file, and so is table: leave one of them out; load cases are a group")
    lengths = {len(v) for v in spec.together.values()}
    if len(lengths) > 1:
        yield Problem(("together",), f"needs lists of equal length; these have {', '.join(map(str, sorted(lengths)))}")
    if spec.sample and spec.sample.count * len(spec.sample.factors) > MAX_VALUES:
        yield Problem(
            ("sample", "count"), f"gives more than {MAX_VALUES} values with {len(spec.sample.factors)} factors"
        )
    for name, factor in (spec.sample.factors if spec.sample else {}).items():
        if isinstance(factor, Normal) and not factor.normal[1] > 0:
            yield Problem(("sample", "factors", name, "normal"), "must be a mean and a standard deviation above 0")
