"""Multi-objective optimisation by a particle swarm (MOPSO) with an archive of the best.

    def evaluate(X):                     # (n, d) natural values: the whole swarm in one call
        return Y, G                      # (n, m) to be minimised, (n, c) allowed where <= 0; G may be None

    front = mopso(space, evaluate, seed=1, constraints=("S_anti",))
    front.points, front.values           # (k, d), (k, m)

``evaluate`` may be a surrogate or a batch of simulations. Rows that come back with nan or inf count as infeasible, so a
simulation that fails does not stop the search. To maximise, return the negative. The same seed gives the same front.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from trainmj.doe.arrays import ROUND_OFF, FloatArray, as_matrix, as_names, frozen
from trainmj.doe.pareto import default_reference, hypervolume
from trainmj.doe.space import Space
from trainmj.doe.swarm import Scores, best_of, improves, random_hypercube, step
from trainmj.errors import InputError

Evaluate = Callable[[FloatArray], tuple[ArrayLike, ArrayLike | None]]


@dataclass(frozen=True)
class SwarmOptions:
    """How long and how wide to search.

    Attributes:
        particles: points evaluated in one call.
        iterations: most calls after the first.
        archive: most points of the front.
        patience: iterations over which the growth of the hypervolume is measured.
        tolerance: the search stops when the hypervolume grew by less than this part over ``patience`` iterations; 0
            never.
    """

    particles: int = 100
    iterations: int = 250
    archive: int = 200
    patience: int = 25
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        """Raise InputError for a count below its least, or a tolerance outside [0, 1)."""
        for name, least in (("particles", 4), ("iterations", 1), ("archive", 4), ("patience", 1)):
            if getattr(self, name) < least:
                raise InputError(f"SwarmOptions.{name} must be at least {least} (got {getattr(self, name)})")
        if not 0 <= self.tolerance < 1:
            raise InputError(f"SwarmOptions.tolerance must lie in [0, 1) (got {self.tolerance})")


@dataclass(frozen=True)
class Progress:
    """The state of a search after one iteration.

    Attributes:
        iteration: 0 is the first swarm.
        evaluations: points computed so far.
        feasible: share of this swarm that keeps all constraints.
        failed: points of this swarm that came back with nan or inf.
        front: points in the archive; 0 as long as none is feasible.
        hypervolume: of the archive, against `Front.reference`.
        growth: part by which the hypervolume grew over the last ``patience`` iterations, against a reference a tenth
            beyond the archive of the moment; nan before that.
    """

    iteration: int
    evaluations: int
    feasible: float
    failed: int
    front: int
    hypervolume: float
    growth: float


@dataclass(frozen=True)
class Front:
    """The best compromises found, sorted by the first objective.

    Attributes:
        points: natural values, (k, d).
        values: objectives, (k, m).
        limits: constraints, all <= 0, (k, c).
        reference: the point up to which the hypervolume counts, a tenth of the front's range beyond it, (m,).
        history: one entry for each iteration.
        status: why the search ended.
        seed: of the random numbers.
    """

    points: FloatArray = field(repr=False)
    values: FloatArray = field(repr=False)
    limits: FloatArray = field(repr=False)
    reference: FloatArray = field(repr=False)
    history: tuple[Progress, ...] = field(repr=False)
    status: str
    seed: int

    @property
    def hypervolume(self) -> float:
        """Volume that the front dominates, up to the reference."""
        return hypervolume(self.values, self.reference)


class InfeasibleError(InputError):
    """No point of a search keeps all constraints.

    Attributes:
        evaluations: points computed.
        nearest: the point that comes nearest, natural values, (d,).
    """

    def __init__(self, evaluations: int, nearest: FloatArray, over: Mapping[str, float]) -> None:
        """Say by how much that point is beyond each constraint that it breaks."""
        self.evaluations, self.nearest = evaluations, nearest
        point, excess = ", ".join(f"{x:.6g}" for x in nearest), ", ".join(f"{n} by {g:.4g}" for n, g in over.items())
        super().__init__(
            f"no point of {evaluations} keeps all constraints; the nearest, ({point}), breaks {excess}; loosen these "
            "limits or widen the factors' bounds"
        )


def mopso(
    space: Space,
    evaluate: Evaluate,
    *,
    seed: int,
    constraints: Sequence[str] | None = None,
    options: SwarmOptions | None = None,
) -> Front:
    """Search the front of several objectives under constraints.

    Args:
        space: the factors; integers and choices are rounded before they are evaluated.
        evaluate: X (n, d) -> Y (n, m), G (n, c) or None.
        seed: of the random numbers.
        constraints: what messages call G's columns; g1, g2, ... if None.
        options: width and length of the search.

    Raises:
        InfeasibleError: no feasible point found.
        InputError: ``evaluate`` returned the wrong shape.
    """
    options = options or SwarmOptions()
    rng = np.random.default_rng(seed)
    scorer = _Scorer(space, evaluate)
    u = random_hypercube(options.particles, space.d, rng)
    velocity = np.zeros_like(u)
    scores = scorer.scores(u)
    memory, archive = scores, best_of(scores, options.archive)
    fronts = [archive.y[archive.feasible]]
    history = [_progress(scores, fronts, options.patience)]
    status = f"stopped after all {options.iterations} iterations, before the hypervolume settled: more may help"
    for iteration in range(1, options.iterations + 1):
        u, velocity = step(u, velocity, memory, archive, iteration / options.iterations, rng)
        scores = scorer.scores(u)
        memory = scores.where(improves(scores, memory), memory)
        archive = best_of(archive.join(scores), options.archive)
        fronts.append(archive.y[archive.feasible])
        history.append(_progress(scores, fronts, options.patience))
        if history[-1].growth < options.tolerance:
            status = f"converged after {iteration} iterations: the hypervolume grew by less than {options.tolerance:g}"
            status += f" over the last {options.patience}"
            break
    _need_feasible(archive, as_names("constraints", constraints, archive.g.shape[1], "g"), history[-1].evaluations)
    archive = archive.take(np.lexsort(archive.y.T[::-1]))
    corner = default_reference(archive.y)
    return Front(
        points=frozen(archive.x),
        values=frozen(archive.y),
        limits=frozen(archive.g),
        reference=frozen(corner),
        history=tuple(replace(p, hypervolume=_volume(y, corner)) for p, y in zip(history, fronts, strict=True)),
        status=status,
        seed=seed,
    )


class _Scorer:
    """Evaluates swarms. Constraints have different units: each counts by its largest excess in the first swarm."""

    def __init__(self, space: Space, evaluate: Evaluate) -> None:
        self.space, self.evaluate = space, evaluate
        self.scale: FloatArray | None = None
        self.first: FloatArray | None = None

    def scores(self, u: FloatArray) -> Scores:
        """Evaluate positions (n, d) in one call."""
        x = self.space.from_unit(u)
        values, limits = self.evaluate(x.copy())
        y = as_matrix("objectives returned by evaluate", values, finite=False)
        g = np.zeros((len(x), 0))
        if limits is not None and np.size(limits):
            g = as_matrix("constraints", limits, finite=False)
        if len(y) != len(x) or len(g) != len(x):
            raise InputError(
                f"evaluate must return one row for each of the {len(x)} points (got {len(y)} and {len(g)})"
            )
        failed = ~(np.isfinite(y).all(axis=1) & np.isfinite(g).all(axis=1))
        y[failed], g[failed] = np.inf, np.inf
        if self.first is None and not failed.all():
            self.first = y[~failed][0]
        if self.first is not None:  # round-off in an objective that is the same everywhere would fill the front
            y = np.where(np.abs(y - self.first) <= ROUND_OFF * np.abs(self.first), self.first, y)
        excess = np.maximum(g, 0.0)
        if self.scale is None and not failed.all():
            largest = excess[~failed].max(axis=0, initial=0.0)
            self.scale = np.where(largest > 0, largest, 1.0)
        violation = excess.sum(axis=1) if self.scale is None else (excess / self.scale).sum(axis=1)
        return Scores(self.space.to_unit(x), x, y, g, np.where(failed, np.inf, violation)[:, None])


def _progress(swarm: Scores, fronts: Sequence[FloatArray], patience: int) -> Progress:
    """The state after the last of the fronts; its hypervolume waits for the final reference."""
    front = fronts[-1]
    growth = np.nan
    if len(front) and len(fronts) > patience:
        corner = default_reference(front)
        volume = hypervolume(front, corner)
        growth = 1.0 - _volume(fronts[-1 - patience], corner) / volume if volume > 0 else np.inf
    return Progress(
        iteration=len(fronts) - 1,
        evaluations=len(fronts) * len(swarm),
        feasible=float(swarm.feasible.mean()),
        failed=int(swarm.failed.sum()),
        front=len(front),
        hypervolume=np.nan,
        growth=growth,
    )


def _volume(front: FloatArray, corner: FloatArray) -> float:
    return hypervolume(front, corner) if len(front) else 0.0


def _need_feasible(archive: Scores, names: tuple[str, ...], evaluations: int) -> None:
    if archive.feasible[0]:
        return
    if archive.failed[0]:
        raise InputError(f"all {evaluations} evaluations gave nan or inf; check one point by hand")
    over = {name: float(g) for name, g in zip(names, archive.g[0], strict=True) if g > 0}
    raise InfeasibleError(evaluations, frozen(archive.x[0]), over)
