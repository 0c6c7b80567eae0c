"""The same collision by other means, from the plain values of a scenario and scipy's integrators alone.

Every device is on one of a few branches, and every vehicle slides or stands; between two switches the motion is smooth,
and the moment of a switch is found as a root. Nothing here imports the code that it is to check. What stays on the
line is solved here, trains in the vertical plane by `plane.solve`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from trainmj.verification.oracle.motion import Found, Motion, Solution
from trainmj.verification.oracle.reading import read

__all__ = ["Found", "Solution", "solve"]


def solve(values: Mapping[str, Any], until: float | None = None) -> Solution:
    """Follow a collision to a given time [s], or until it is over or its time limit has come.

    Args:
        values: a scenario as its YAML file gives it, with points in place of the names of files.
        until: the time to stop at, whether the collision is over before or not.

    Raises:
        EngineError: if the integration fails.
    """
    system = read(values)
    motion = Motion(system)
    over = motion.go(system.time_limit if until is None else until, stop_when_over=until is None)
    return motion.solution(motion.t, over if not math.isnan(over) else math.nan)
