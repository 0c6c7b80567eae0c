"""Figures of a reliability run: how a probability settles, and how near the draws come to the limit that governs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from trainmj.output.style import BLUE, GREY, ORANGE, figure
from trainmj.reliability.found import Passed, ReliabilityResult
from trainmj.reliability.tables import titled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def shown(result: ReliabilityResult) -> list[Passed]:
    """What is drawn over the draws: any limit, and the one that governs."""
    governing = result.governing
    return [result.any] + ([governing] if governing is not None else [])


def convergence(result: ReliabilityResult) -> Figure:
    """The probability over the number of draws, with its interval."""
    picture = figure()
    axes = picture.subplots()
    for one, colour, line in zip(shown(result), (BLUE, ORANGE), ("-", "--"), strict=False):
        r = one.running
        axes.fill_between(r.draws, r.lower, r.upper, color=colour, alpha=0.15, linewidth=0)
        axes.plot(r.draws, r.value, line, color=colour, label=titled(one))
    axes.set_xscale("log")
    axes.set_ylim(bottom=0)
    axes.set_xlabel("draws")
    axes.set_ylabel("probability that it is passed")
    axes.legend()
    level = 100 * result.plan.spec.level
    picture.suptitle(f"Running probability with its {level:g} % interval", x=0.01, ha="left", fontweight="bold")
    return picture


def distribution(result: ReliabilityResult) -> Figure | None:
    """How much of the limit that governs the draws use; None if there is no limit."""
    one = result.governing
    if one is None or not one.used.size:
        return None
    picture = figure()
    axes = picture.subplots()
    axes.plot(one.used, np.linspace(0.0, 1.0, one.used.size), color=BLUE, label="draws")
    axes.axvline(100.0, color=ORANGE, linestyle="--", label="limit")
    if one.designed is not None and one.limit:
        axes.axvline(100.0 * abs(one.designed) / one.limit, color=GREY, linestyle=":", label="as designed")
    axes.set_ylim(0, 1)
    axes.set_xlabel(f"part of the limit of {one.limit:.12g} {one.unit} that is used (%)")
    axes.set_ylabel("share of the draws at or below")
    axes.legend()
    picture.suptitle(titled(one)[:1].upper() + titled(one)[1:], x=0.01, ha="left", fontweight="bold")
    return picture


FIGURES: dict[str, Callable[[ReliabilityResult], Figure | None]] = {
    "convergence": convergence,
    "distribution": distribution,
}
"""The figures of the folder, by the names of their files."""
