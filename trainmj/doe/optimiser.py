"""Multi-objective optimisation by a particle swarm (MOPSO) with an archive of the best.

    def evaluate(X):                     # (n, d) natural values: the whole swarm in one call
        return Y, G                      # (n, m) to be minimised, (n, c) allowed where <= 0; G may be None

    front = mopso(space, evaluate, seed=1, constraints=("S_anti",))
    front.points, front.values           # (k, d), (k, m)

``evaluate`` may be a surrogate or a batch of simulations. Rows that come back with nan or inf count as infeasible, so a
simulation that fails does not stop the search. To maximise, return the negative. The same seed gives the same front.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from trainmj.doe.arrays import FloatArray, as_matrix, as_names, frozen
from trainmj.doe.pareto import default_reference, hypervolume
from trainmj.doe.space import Space
from trainmj.doe.swarm import Scores, best_of, improves, step
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
        """Check the numbers.

        Raises:
            InputError: a count below its least, or a tolerance outside [0, 1).
        """
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
        InputError: no feasible point found (the message says which constraint is nearest), or ``evaluate`` returned the
            wrong shape.
    """
    options = options or SwarmOptions()
    search = _Search(space, evaluate, np.random.default_rng(seed), options)
    u = search.first_positions()
    scores = search.evaluate_swarm(u)
    velocity = np.zeros_like(u)
    memory, archive = scores, best_of(scores, options.archive)
    history = [search.note(scores, archive)]
    status = f"stopped after all {options.iterations} iterations, before the hypervolume settled: more may help"
    for iteration in range(1, options.iterations + 1):
        u, velocity = step(u, velocity, memory, archive, iteration / options.iterations, search.rng)
        scores = search.evaluate_swarm(u)
        memory = scores.where(improves(scores, memory), memory)
        archive = best_of(archive.join(scores), options.archive)
        history.append(search.note(scores, archive))
        if history[-1].growth < options.tolerance:
            status = f"converged after {iteration} iterations: the hypervolume grew by less than {options.tolerance:g}"
            status += f" over the last {options.patience}"
            break
    _need_feasible(archive, as_names("constraints", constraints, archive.g.shape[1], "g"), history[-1].evaluations)
    archive = archive.take(np.lexsort(archive.y.T[::-1]))
    corner = default_reference(archive.y)
    volumes = [_volume(y, corner) for y in search.archives]
    return Front(
        points=frozen(archive.x),
        values=frozen(archive.y),
        limits=frozen(archive.g),
        reference=frozen(corner),
        history=tuple(replace(p, hypervolume=v) for p, v in zip(history, volumes, strict=True)),
        status=status,
        seed=seed,
    )


def _need_feasible(archive: Scores, names: tuple[str, ...], evaluations: int) -> None:
    if archive.feasible[0]:
        return
    if archive.failed[0]:
        raise InputError(f"all {evaluations} evaluations gave nan or inf; check one point by hand")
    over = {name: float(g) for name, g in zip(names, archive.g[0], strict=True) if g > 0}
    raise InputError(
        f"no point of {evaluations} keeps all constraints; the nearest, {archive.x[0].tolist()}, exceeds {over}; "
        "loosen these limits or widen the factors' bounds"
    )


def _volume(y: FloatArray, corner: FloatArray) -> float:
    """Hypervolume of a front (k, m), which may be empty."""
    return hypervolume(y, corner) if len(y) else 0.0


class _Search:
    """What stays the same during a search, and the growth of its archive."""

    def __init__(self, space: Space, evaluate: Evaluate, rng: np.random.Generator, options: SwarmOptions) -> None:
        self.space, self.evaluate, self.rng, self.options = space, evaluate, rng, options
        self.archives: list[FloatArray] = []  # objectives of the feasible archive after each iteration
        self.evaluations = 0
        self.scale: FloatArray | None = None

    def first_positions(self) -> FloatArray:
        """A random Latin hypercube, (n, d)."""
        n, d = self.options.particles, self.space.d
        return (np.stack([self.rng.permutation(n) for _ in range(d)], axis=1) + self.rng.random((n, d))) / n

    def evaluate_swarm(self, u: FloatArray) -> Scores:
        """Evaluate positions (n, d) in one call."""
        x = self.space.from_unit(u)
        values, limits = self.evaluate(x.copy())
        y = as_matrix("objectives returned by evaluate", values, finite=False)
        g = (
            np.zeros((len(x), 0))
            if limits is None or np.size(limits) == 0
            else as_matrix("constraints", limits, finite=False)
        )
        if len(y) != len(x) or len(g) != len(x):
            raise InputError(
                f"evaluate must return one row for each of the {len(x)} points (got {len(y)} and {len(g)})"
            )
        failed = ~(np.isfinite(y).all(axis=1) & np.isfinite(g).all(axis=1))
        y[failed], g[failed] = np.inf, np.inf
        excess = np.maximum(g, 0.0)
        if self.scale is None and not failed.all():  # constraints have different units: weigh them by the first swarm
            largest = excess[~failed].max(axis=0, initial=0.0)
            self.scale = np.where(largest > 0, largest, 1.0)
        violation = excess.sum(axis=1) if self.scale is None else (excess / self.scale).sum(axis=1)
        self.evaluations += len(x)
        return Scores(self.space.to_unit(x), x, y, g, np.where(failed, np.inf, violation)[:, None])

    def note(self, swarm: Scores, archive: Scores) -> Progress:
        """Record one iteration; the growth compares two archives against one reference."""
        now = archive.y if archive.feasible[0] else archive.y[:0]
        self.archives.append(now)
        volume, growth = 0.0, np.nan
        if len(now):
            corner = default_reference(now)
            volume = hypervolume(now, corner)
            if len(self.archives) > self.options.patience:
                before = _volume(self.archives[-1 - self.options.patience], corner)
                growth = 1.0 - before / volume if volume > 0 else np.inf
        failed, share = int(swarm.failed.sum()), float(swarm.feasible.mean())
        return Progress(len(self.archives) - 1, self.evaluations, share, failed, len(now), float(volume), float(growth))
