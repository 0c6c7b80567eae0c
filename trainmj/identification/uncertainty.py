"""What the data determine: standard errors, correlations, and combinations of parameters that hardly matter.

The residuals r are linearised at the best trial: with their derivatives J the covariance is (J'J)^-1, if tolerances are
standard deviations. If the misfit is larger than they imply, errors grow by the square root of r'r / (n - p). Intervals
are the wider of those by the tolerances, of the normal distribution, and by the misfit, of Student's t with n - p
degrees of freedom; they are on the axis of the parameter: on a log scale they are factors.

A parameter at its bound is held there: it has no error, and those of the others hold only while it stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.identification.misfit import REFUSED, Misfit
from trainmj.identification.sought import Unknown
from trainmj.identification.unknowns import Point

AT_BOUND = 1e-3
"""Distance from a bound, as part of the range, within which a parameter counts as at it."""

WIDE = 0.25
"""A direction is undetermined if one standard deviation along it is more than this part of the ranges."""

TIED = 0.95
"""Two parameters are determined only in combination if their errors correlate by more than this: if the one were known,
the error of the other would be less than a third."""

MEANING = (
    "Determined is a parameter that the data fix by itself: not one at its bound, where the bounds put it and not the "
    f"data; not one whose error correlates with another's by more than {TIED:g}, of which they fix the combination; "
    f"not one whose standard error is more than {100 * WIDE:g} % of its range."
)
"""What it means that a parameter is determined."""

_WORDS = 4  # parameters that a direction names at most
_LEAST = 0.3  # component of a direction that is worth naming
_ALONE = 0.95  # component of a direction that is one parameter
_NOTHING = 1e-12  # change of the residuals over a whole range that counts as none
_DIGITS = 6  # of the degrees of freedom, behind the point
_TINY = 1e-9  # singular value that counts as zero, as part of the largest


@dataclass(frozen=True)
class Direction:
    """A combination of parameters, as parts of their ranges, and how well the data determine it."""

    parts: Array  # (n,) unit vector over all free parameters; 0 for those at a bound
    deviation: float  # one standard deviation along it, as part of the ranges; infinite if nothing changes

    @property
    def determined(self) -> bool:
        """Whether the data determine it."""
        return self.deviation <= WIDE

    def in_words(self, names: Sequence[str]) -> str:
        """What moves together along it: ``k_front up, c_front down``."""
        order = [k for k in np.argsort(-np.abs(self.parts), kind="stable") if abs(self.parts[k]) >= _LEAST]
        said = [f"{names[k]} {'up' if self.parts[k] > 0 else 'down'}" for k in order[:_WORDS]]
        if len(said) == 1 and abs(self.parts[order[0]]) > _ALONE:
            return f"{names[order[0]]} alone"
        rest = float(np.sum(self.parts**2) - np.sum(self.parts[order[:_WORDS]] ** 2))
        return ", ".join(said or ["many"]) + (" and others" if rest > _LEAST else "")


@dataclass(frozen=True)
class Uncertainty:
    """What the data determine at a trial."""

    lower: Array  # (n,) end of the 95 % interval; NaN where there is none
    upper: Array  # (n,) likewise
    error: Array  # (n,) standard error; NaN where there is none. On a log scale, as part of the value
    at_bound: tuple[str, ...]  # (n,) "lower", "upper" or ""
    correlation: Array  # (n, n); NaN for parameters at a bound
    directions: tuple[Direction, ...]  # of the free parameters that are not at a bound, worst determined first
    freedom: float  # degrees of freedom n - p; a channel counts as its target states
    chi2: float  # r'r over freedom
    tied: tuple[tuple[int, ...], ...]  # (n,) those with which each is determined only in combination, largest |r| first
    open: tuple[bool, ...]  # (n,) whether the error of one not at a bound is more than WIDE of its range, or not known

    @property
    def standing(self) -> dict[str, int]:
        """How many parameters are determined, at a bound, only determined together, or open: each counted once."""
        of_each = [
            "at a bound" if bound else "open" if wide else "only together" if tied else "determined"
            for bound, tied, wide in zip(self.at_bound, self.tied, self.open, strict=True)
        ]
        return {name: of_each.count(name) for name in ("determined", "at a bound", "only together", "open")}

    @property
    def determined(self) -> tuple[bool, ...]:
        """(n,) whether the data determine each parameter: see MEANING."""
        of_each = zip(self.at_bound, self.tied, self.open, strict=True)
        return tuple(not (bound or tied or wide) for bound, tied, wide in of_each)


def uncertainty(misfit: Misfit, point: Point, difference: float) -> Uncertainty:
    """What the data determine at a trial, from a misfit of norm 2 at the step of the refinement.

    The difference is for derivatives, which are central here, as part of the range.
    """
    from scipy.stats import norm, t

    unknowns = misfit.plan.unknowns
    parameters = unknowns.parameters
    n_value = int((misfit.plan.fitted.weight > 0).sum())
    at_bound = tuple(_bound(p, value) for p, value in zip(parameters, point.value, strict=True))
    moving = [k for k in unknowns.free if not at_bound[k]]
    residuals, derivative, follow = _derivatives(misfit, point, moving, difference, n_value)
    sample = misfit.plan.fitted
    left = round(float(sample.share[sample.weight > 0].sum()) - len(moving), _DIGITS)
    freedom = int(left) if left.is_integer() else left
    chi2 = float(np.sum(residuals**2) / freedom) if freedom > 0 else np.nan
    grown = float(np.sqrt(max(1.0, chi2))) if freedom > 0 else 1.0
    _, singular, turned = np.linalg.svd(derivative, full_matrices=False)
    floor = max(_TINY * float(singular.max(initial=0.0)), _NOTHING)
    deviations = grown / np.maximum(singular, floor)
    directions = []
    for k in np.argsort(-deviations, kind="stable"):
        parts = np.zeros(len(parameters))
        parts[moving] = turned[k] * np.sign(turned[k][np.argmax(np.abs(turned[k]))])
        directions.append(Direction(parts, float(deviations[k]) if singular[k] > floor else np.inf))
    root = follow @ (turned.T * deviations)  # (n, m): covariance is root root'
    spread = np.sqrt(np.sum(root**2, axis=1))
    known = spread > 0
    correlation = np.full((len(parameters), len(parameters)), np.nan)
    unit = root[known] / spread[known, None]
    correlation[np.ix_(known, known)] = np.clip(unit @ unit.T, -1.0, 1.0)
    ranges = np.array([p.range for p in parameters])
    error = np.where(known, spread * ranges, np.nan)  # on the axis of each parameter
    wide = float(norm.ppf(0.975))
    if freedom > 0:  # the wider of what the tolerances and the scatter about the fit say
        wide = max(wide, float(t.ppf(0.975, freedom)) * float(np.sqrt(chi2))) / grown
    ends = [
        (p.value(p.scaled(v) - wide * e), p.value(min(p.scaled(v) + wide * e, 600.0) if p.log else v + wide * e))
        for p, v, e in zip(parameters, point.value, error, strict=True)
    ]
    lower, upper = np.array(ends).T
    wide_open = tuple(not (bound or e <= WIDE * r) for bound, e, r in zip(at_bound, error, ranges, strict=True))
    tied = tuple(_tied(correlation[k], moving, k) for k in range(len(parameters)))
    return Uncertainty(lower, upper, error, at_bound, correlation, tuple(directions), freedom, chi2, tied, wide_open)


def _tied(correlation: Array, moving: list[int], k: int) -> tuple[int, ...]:
    """The parameters tied to one; not those that a constraint solves for, which it ties, not the data."""
    if k not in moving:
        return ()
    return tuple(
        sorted((j for j in moving if j != k and abs(correlation[j]) > TIED), key=lambda j: -abs(correlation[j]))
    )


def _bound(p: Unknown, value: float) -> str:
    near, at = AT_BOUND * p.range, p.scaled(value)
    return "lower" if at - p.scaled(p.lower) < near else "upper" if p.scaled(p.upper) - at < near else ""


def _derivatives(
    misfit: Misfit, point: Point, moving: list[int], difference: float, n_value: int
) -> tuple[Array, Array, Array]:
    """Residuals, their derivatives (n_value, m), and those of all parameters (n, m), over parts of the ranges."""
    unknowns = misfit.plan.unknowns
    parameters = unknowns.parameters
    ends: list[Point] = []
    for k in moving:
        p = parameters[k]
        for side in (1.0, -1.0):
            values = point.value.copy()
            scaled = p.scaled(values[k]) + side * difference * p.range
            values[k] = p.value(float(np.clip(scaled, p.scaled(p.lower), p.scaled(p.upper))))
            ends.append(unknowns.solved(values))
    here, *there = misfit.of_points([point, *ends])
    columns, follow = [], []
    for n, k in enumerate(moving):
        pair = [(ends[i], there[i]) for i in (2 * n, 2 * n + 1) if np.abs(there[i]).max() < REFUSED]
        (ahead, far), (behind, near) = (*pair, (point, here), (point, here))[:2]
        moved = _axes(misfit, ahead) - _axes(misfit, behind)
        width = moved[k]
        columns.append((far - near)[:n_value] / width if width else np.zeros(n_value))
        follow.append(moved / width if width else np.eye(len(parameters))[k])
    m = len(moving)
    return (
        here[:n_value],
        np.array(columns).T.reshape(n_value, m),
        np.array(follow).T.reshape(len(parameters), m),
    )


def _axes(misfit: Misfit, point: Point) -> Array:
    """(n,) where a trial is on the axis of each parameter, as part of its range."""
    return np.array([p.scaled(v) / p.range for p, v in zip(misfit.plan.unknowns.parameters, point.value, strict=True)])
