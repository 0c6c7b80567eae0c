"""An end stop behind the stroke of a device, and the car body behind that."""

from __future__ import annotations

from numba.extending import register_jitable


@register_jitable
def stopped(over: float, given: float, stiffness: float, most: float) -> tuple[float, float]:
    """Force of a stop [N], and what the car body behind it has given way [m].

    Args:
        over: stroke behind the end of the device [m].
        given: what the body has given way before [m].
        stiffness: of the stop [N/m].
        most: collapse force of the body, less what the device itself carries at its end [N]; infinite for none.
    """
    force = stiffness * (over - given)
    if force <= 0.0:
        return 0.0, given
    if force > most:
        return most, over - most / stiffness
    return force, given
