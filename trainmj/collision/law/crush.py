"""Crush: a device follows its envelope as it is pressed, and unloads along its stiffness.

The plastic state u_p is the stroke at which the force would vanish. With the unloading stiffness K and the dashpot c::

    F_el = K (u - u_p)
    F_el >= F_env(u):   F = F_env(u), u_p = u - F / K           crushing: the state moves, energy is lost
    0 < F_el < F_env:   F = F_el + c du/dt, within [0, F_env]   unloading and reloading
    otherwise           F = 0                                   devices push, they never pull
"""

from __future__ import annotations


def respond(
    stroke: float, rate: float, plastic: float, stiffness: float, damping: float, crush: float
) -> tuple[float, float]:
    """Force and plastic state after one step of the law.

    Args:
        stroke: compression u at the end of the step [m].
        rate: du/dt [m/s].
        plastic: plastic state u_p before the step [m].
        stiffness: unloading stiffness K [N/m].
        damping: dashpot c on the elastic branch [N s/m].
        crush: F_env(u) [N]; of no account where u <= u_p.

    Returns:
        The force F [N] and the plastic state u_p [m] after the step.
    """
    elastic = stiffness * (stroke - plastic)
    if elastic <= 0.0:
        return 0.0, plastic
    if elastic >= crush:
        return crush, stroke - crush / stiffness
    return min(crush, max(0.0, elastic + damping * rate)), plastic
