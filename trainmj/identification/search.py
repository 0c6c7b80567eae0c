"""The search: everywhere between the bounds by an evolution strategy, then downhill by least squares.

CMA-ES (Hansen and Ostermeier 2001, doi 10.1162/106365601750190398; the package cma) needs no derivatives and crosses
the small jumps of the responses; each population is one batch. The refinement is scipy's trust region for bounded least
squares (Branch, Coleman and Li 1999, doi 10.1137/S1064827595289108); the trials of a derivative by differences are one
batch, too. Everything follows from the seed, so a search that is started again finds its trials computed and goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.identification.file import ExplorePart
from trainmj.identification.misfit import Misfit, Trials
from trainmj.identification.plan import Identification

_SMALL = 1e-7  # relative change of the sum of squares, or of the place, at which a refinement ends
_TRIES = 20  # steps tried in an iteration, on average: each is shortened until it leads downhill
_NEXT = 1e-6  # distance from a bound, as part of the range, that counts as none
_FLAT = 1e-12  # slope that counts as flat


class Place(NamedTuple):
    """A place of the unit cube and its cost."""

    cost: float
    unit: Array


class Progress(NamedTuple):
    """How far a search is."""

    phase: str  # explore, refine or finish
    done: int  # trials of the exploration, or iterations
    of: int  # how many there may be
    cost: float  # smallest so far


Watch = Callable[[Progress], None]


def search(plan: Identification, trials: Trials, watch: Watch = lambda progress: None) -> tuple[Place, list[Progress]]:
    """The best place that the method of an identification finds, and the way to it."""
    way: list[Progress] = []

    def note(progress: Progress) -> None:
        way.append(progress)
        watch(progress)

    method = plan.spec.method
    first = method.explore
    coarse = Misfit(plan, trials, first.step_ms, first.cases, ratio=first.slope_ratio, bars=False)
    starts = explore(coarse, first, method.seed, note)[: method.refine.starts]
    fine = Misfit(plan, trials, method.refine.step_ms)
    iterations, difference = method.refine.iterations, method.refine.difference
    ends = [refine(fine, place.unit, iterations, difference, "refine", note) for place in starts]
    best = min(ends, key=lambda place: place.cost)
    if method.finish is not None:
        largest = float(np.abs(fine.residuals([best.unit])).max())
        high = Misfit(plan, trials, method.refine.step_ms, norm=method.finish.norm, size=largest or 1.0)
        best = refine(high, best.unit, method.finish.iterations, difference, "finish", note)
    return best, way


def explore(misfit: Misfit, part: ExplorePart, seed: int, watch: Watch) -> list[Place]:
    """Search with evolution strategies side by side: the best place that each finds, the best one first."""
    unknowns = misfit.plan.unknowns
    start = unknowns.place(unknowns.start().value) if part.start == "start" else np.full(unknowns.n_axes, 0.5)
    first = Place(float(misfit.cost([start])[0]), start)
    if part.trials == 0:
        return [first]
    best = [first] * part.searches
    size = part.population or 4 + int(3 * np.log(start.size))
    strategies = [_strategy(start, part.spread, size, rng) for rng in np.random.default_rng(seed).spawn(part.searches)]
    done = 1
    while done + size <= part.trials and (at_work := [k for k in range(part.searches) if not strategies[k].stop()]):
        asked = [strategies[k].ask() for k in at_work]
        units = [np.asarray(x, dtype=float)[: start.size] for cloud in asked for x in cloud]
        costs = misfit.cost(units).reshape(len(at_work), size)  # all of them are one batch
        for n, k in enumerate(at_work):
            strategies[k].tell(asked[n], costs[n].tolist())
            m = int(np.argmin(costs[n]))
            best[k] = min(best[k], Place(float(costs[n, m]), units[n * size + m]), key=lambda place: place.cost)
        done += size
        watch(Progress("explore", done, part.trials, min(place.cost for place in best)))
    return sorted(best, key=lambda place: place.cost)


def _strategy(start: Array, spread: float, size: int, rng: np.random.Generator) -> Any:
    """A CMA-ES over the unit cube that starts at a place."""
    import cma

    options = {
        "bounds": [0, 1],
        "popsize": size,
        "seed": np.nan,  # leaves numpy's global state alone: all random numbers come from randn
        "randn": lambda *shape: rng.standard_normal(shape),
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
        "tolfun": 1e-9,
        "tolx": 1e-6,
    }
    # cma refuses to search along a single axis, so it gets a second one that does nothing
    return cma.CMAEvolutionStrategy(np.append(start, 0.5) if start.size == 1 else start, spread, options)


def refine(misfit: Misfit, unit: Array, iterations: int, difference: float, phase: str, watch: Watch) -> Place:
    """Refine a place (n_axes,) by least squares; the difference, for derivatives, is a part of the range."""
    from scipy.optimize import least_squares

    best = Place(float(misfit.cost([unit])[0]), unit)
    if not iterations:
        return best
    done = 0

    def residuals(x: Array) -> Array:
        nonlocal best
        found: Array = misfit.residuals([x])[0]
        cost = float(0.5 * np.sum(found**2))
        if cost < best.cost:
            best = Place(cost, x.copy())
        return found

    def jacobian(x: Array) -> Array:
        nonlocal done
        if done == iterations:
            raise _EnoughError
        result = misfit.jacobian(x, difference)
        done += 1
        watch(Progress(phase, done, iterations, best.cost))
        return result

    with suppress(_EnoughError):
        least_squares(
            residuals,
            _at_bounds(unit),
            jacobian,
            bounds=(0.0, 1.0),
            method="dogbox",  # moves along bounds, where the default shortens every step
            ftol=_SMALL,
            xtol=_SMALL,
            gtol=_FLAT,
            max_nfev=_TRIES * iterations,
        )
    return best


def _at_bounds(unit: Array) -> Array:
    """The place with axes very near a bound put on it: from beside a bound every step is cut to nothing."""
    return np.asarray(np.where(unit < _NEXT, 0.0, np.where(unit > 1.0 - _NEXT, 1.0, unit)))


class _EnoughError(Exception):
    """All iterations are done."""
