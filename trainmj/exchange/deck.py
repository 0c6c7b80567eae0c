"""A collision as nodes and springs, which is what crash programs know: the same for all of their formats, in SI.

A spring acts between two nodes along x. Its closure u is how much closer they are than at the start, its force is
positive where it pushes them apart. Curves are straight between their points and go on along their last part.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from textwrap import wrap

import numpy as np

from trainmj.collision.envelope import Array


@dataclass(frozen=True)
class Curve:
    """A piecewise linear curve.

    Attributes:
        x: (n,) closures [m] or rates [m/s], rising.
        y: (n,) forces [N] or factors.
    """

    x: Array
    y: Array

    @property
    def steepest(self) -> float:
        """Its largest slope, up or down."""
        return float(np.abs(np.diff(self.y) / np.diff(self.x)).max())


@dataclass(frozen=True)
class Node:
    """A point mass that slides along x.

    Attributes:
        name: in words.
        vehicle: whose mass it is part of; empty for what is fixed.
        x: where it is drawn [m].
        mass: [kg]; also of what is fixed, as programs take their steps from masses.
        speed: along +x at the start [m/s].
    """

    name: str
    vehicle: str
    x: float
    mass: float
    speed: float = 0.0

    @property
    def fixed(self) -> bool:
        """Whether it does not move."""
        return not self.vehicle


@dataclass(frozen=True)
class Spring:
    """What acts between two nodes, by their places in the deck; the left one first."""

    name: str
    left: int
    right: int


@dataclass(frozen=True)
class Linear(Spring):
    """A spring [N/m] with a dashpot [N s/m] beside it, in both directions."""

    stiffness: float
    damping: float = 0.0


@dataclass(frozen=True)
class Crush(Spring):
    """A spring that crushes along a curve and unloads along a stiffness [N/m], in one direction only.

    The curve is over the closure, or over the extension where it pulls.
    """

    curve: Curve
    stiffness: float
    pulls: bool = False


@dataclass(frozen=True)
class Elastic(Spring):
    """A spring whose force follows a curve over the closure, times a curve over the closing rate if it has one."""

    curve: Curve
    rate: Curve | None = None


@dataclass(frozen=True)
class Friction(Spring):
    """A spring that slips at a force [N], in both directions, and hardens over its slip by a slope [N/m]."""

    stiffness: float
    force: float
    hardening: float = 0.0


@dataclass(frozen=True)
class Hysteresis(Spring):
    """A spring between two curves over the closure, loading above unloading, along a stiffness [N/m] between them."""

    loading: Curve
    unloading: Curve
    stiffness: float


@dataclass(frozen=True)
class Load:
    """A force on a node along +x [N] over time [s]."""

    name: str
    node: int
    curve: Curve


@dataclass
class Deck:
    """A collision as nodes and springs.

    Attributes:
        title: in one line.
        sides: what its interfaces are made of, a line each.
        step: largest step of an explicit program [s].
        end: when it ends [s].
        record: time between two records [s].
        nodes: of vehicles from left to right, then of what is between them.
        springs: between nodes.
        loads: on nodes.
        kinds: kinds of law that are in it; what a program does differently is said for these.
    """

    title: str
    step: float
    end: float
    record: float
    sides: list[str] = field(default_factory=list)
    nodes: list[Node] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    loads: list[Load] = field(default_factory=list)
    kinds: set[str] = field(default_factory=set)

    def fixed(self) -> Iterator[int]:
        """Places of the nodes that do not move."""
        return (k for k, node in enumerate(self.nodes) if node.fixed)

    def free(self) -> Iterator[int]:
        """Places of the nodes that do."""
        return (k for k, node in enumerate(self.nodes) if not node.fixed)


def header(
    deck: Deck, mark: str, about: Iterable[str], program: str, differences: Mapping[str, str], width: int
) -> Iterator[str]:
    """The comments at the head of a file.

    Args:
        deck: that is written.
        mark: of a comment.
        about: lines on the file.
        program: that reads it.
        differences: what it does differently, by kind of device; those of the deck are said.
        width: of a line, in characters.
    """
    yield f"{mark} {deck.title}"
    yield mark
    yield from (f"{mark} {line}" for line in about)
    yield mark
    yield f"{mark} What is at the interfaces:"
    yield from (f"{mark}   {side}" for side in deck.sides)
    yield mark
    yield f"{mark} What {program} does differently from trainmj:"
    for kind, said in differences.items():
        if kind in deck.kinds:
            first, further = f"{mark}   {kind + ':':<12}", f"{mark}   {'':<12}"
            yield from wrap(said, width, initial_indent=first, subsequent_indent=further)
    yield mark
