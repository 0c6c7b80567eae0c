"""Lines along which devices act in the vertical plane: a strut between two pins, or two faces that meet."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class LineEnd:
    """One vehicle's end of a line, as its device states it.

    Attributes:
        strut: whether it is a strut between pins; otherwise a face.
        height: above the rail, where the vehicle stands as designed [m].
        pin: of a strut, from the pin to the coupling face [m].
        free: of a strut, angle by which it swings at its pin before the stop [rad]; infinite without one.
        swing: stiffness of that stop [N m/rad].
        friction: of a face, coefficient of the vertical tie.
        tooth: part of its capacity that does not depend on the force [N].
        tie: its stiffness [N/m]; 0 without one.
        overlap: step at which two such faces slide off each other [m].
    """

    strut: bool
    height: float
    pin: float = 0.0
    free: float = math.inf
    swing: float = 0.0
    friction: float = 0.0
    tooth: float = 0.0
    tie: float = 0.0
    overlap: float = math.inf


@dataclass(frozen=True)
class Line:
    """A line with both of its ends.

    Attributes:
        left: that of the left vehicle.
        right: that of the right one; a wall has the face of the left and the height at which that stands at the start.
        walled: whether the right end is on a wall.
        inner: whether it is between vehicles of a train, so that a strut is coupled from the start.
        shears: whether a strut is dead once its law has ended.
    """

    left: LineEnd
    right: LineEnd
    walled: bool = False
    inner: bool = False
    shears: bool = False

    @property
    def strut(self) -> bool:
        """Whether it is a strut between pins."""
        return self.left.strut

    @property
    def friction(self) -> float:
        """Coefficient of the vertical tie: that of the weaker face."""
        return min(self.left.friction, self.right.friction)

    @property
    def tooth(self) -> float:
        """Capacity of the tie without force, likewise [N]."""
        return min(self.left.tooth, self.right.tooth)

    @property
    def tie(self) -> float:
        """Stiffness of the tie, likewise [N/m]."""
        return min(self.left.tie, self.right.tie)

    @property
    def overlap(self) -> float:
        """Step at which the faces slide off each other, likewise [m]."""
        return min(self.left.overlap, self.right.overlap)
