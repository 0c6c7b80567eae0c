"""Points that are whole multiples of a resolution: a mass to 0.05 t, an empty stroke to 1 mm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from trainmj.doe import Space
from trainmj.doe.arrays import FloatArray, as_matrix


@dataclass(frozen=True)
class Lattice:
    """A space whose continuous factors are counted in steps, and the way back.

    Attributes:
        space: the space in natural values.
        steps: the same space with the factors that have a resolution as integers 0, 1, ...
        size: the step of each factor; nan for one that has none, (d,).
    """

    space: Space
    steps: Space
    size: FloatArray

    @classmethod
    def of(cls, space: Space, resolution: Mapping[str, float]) -> Lattice:
        """Count some factors of a space in steps.

        Args:
            space: natural values.
            resolution: step by name of a continuous factor, a whole part of its range.
        """
        factors = []
        for factor in space.factors:
            if factor.name in resolution:
                count = round((factor.upper - factor.lower) / resolution[factor.name])
                factor = replace(factor, lower=0.0, upper=float(count), kind="integer")
            factors.append(factor)
        size = np.array([resolution.get(name, np.nan) for name in space.names])
        return cls(space, Space(tuple(factors)), size)

    def natural(self, points: FloatArray) -> FloatArray:
        """Natural values (n, d) of points (n, d) in steps."""
        points = as_matrix("points", points, self.space.d)
        stepped = np.isfinite(self.size)
        values = points.copy()
        values[:, stepped] = self.space.lower[stepped] + points[:, stepped] * self.size[stepped]
        return self.space.round(np.round(values, 10))  # 30.150000000000002 is 30.15
