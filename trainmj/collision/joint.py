"""What the compiled law does at an interface, in one dimension as in the vertical plane: it presses and it counts."""

from __future__ import annotations

from trainmj.collision.element import advance
from trainmj.collision.fields import CAR, ELEMENT, HEAD, JOINT, N_CAR, N_JOINT, Block
from trainmj.collision.jitable import inlined, jitable

APPROACH_SPEED = 0.01
"""A collision is over when no interface carries force and none comes closer faster than this [m/s]."""


@inlined
def press(s: Block, j: int, e: int, u: float, rate: float, elapsed: float, time: float) -> tuple[float, bool, bool]:
    """Move an element of an interface.

    Returns:
        Its force; whether it is draw gear that comes taut; whether it had its largest force on the way.
    """
    one, one_peak = advance(s, e, u, rate, elapsed, time)
    taut = peaked = False
    if s[e + ELEMENT.SIGN] < 0.0:
        s[j + JOINT.PULL_MAX] = max(s[j + JOINT.PULL_MAX], one_peak, -one)
        taut = s[e + ELEMENT.BROKEN] == 0.0 and rate < -APPROACH_SPEED  # what is pulled apart comes taut
    elif one_peak > one:
        s[j + JOINT.ABOVE] += one_peak - one
        peaked = True
    return one, taut, peaked


@inlined
def count(s: Block, j: int, u: float, force: float, time: float) -> None:
    """Note the stroke and force of an interface."""
    if force != 0.0:
        if s[j + JOINT.FIRST_FORCE_TIME] < 0.0:
            s[j + JOINT.FIRST_FORCE_TIME] = time
        s[j + JOINT.LAST_FORCE_TIME] = time
        largest, before = s[j + JOINT.FORCE_MAX], s[j + JOINT.FORCE]
        if force > largest:
            s[j + JOINT.FORCE_MAX], s[j + JOINT.FORCE_RISE], s[j + JOINT.FORCE_FALL] = (
                force,
                force - before,
                2.0 * force,
            )
        elif before == largest:
            s[j + JOINT.FORCE_FALL] = min(s[j + JOINT.FORCE_FALL], before - force)
    s[j + JOINT.STROKE] = u
    s[j + JOINT.FORCE] = force
    if u > s[j + JOINT.STROKE_MAX]:
        s[j + JOINT.STROKE_MAX] = u
        s[j + JOINT.STROKE_MAX_TIME] = time


@inlined
def swing(s: Block, c: int, net: float) -> None:
    """Note how the force of the devices on a vehicle changes; CAR.NET still has that of the evaluation before."""
    before = s[c + CAR.NET]
    if net != before:
        s[c + CAR.SWUNG] += abs(net - before)
        largest = s[c + CAR.DEVICE_FORCE]
        if abs(net) > largest:
            _rise(s, c, net, before)
        elif abs(before) == largest:
            _fall(s, c, net, before)


@jitable
def _rise(s: Block, c: int, net: float, before: float) -> None:
    """The force is larger than ever."""
    force = abs(net)
    s[c + CAR.DEVICE_FORCE], s[c + CAR.DEVICE_PEAK] = force, force / s[c + CAR.MASS]
    s[c + CAR.PEAK_RISE], s[c + CAR.PEAK_FALL] = force - (before if net > 0.0 else -before), 2.0 * force
    s[c + CAR.PEAK_SWUNG] = s[c + CAR.SWUNG]


@jitable
def _fall(s: Block, c: int, net: float, before: float) -> None:
    """It was so at the evaluation before; where it stayed so for several, it has not fallen by a step."""
    fall = abs(before) - (net if before > 0.0 else -net) if s[c + CAR.NET_BEFORE] != before else 0.0
    s[c + CAR.PEAK_FALL] = min(s[c + CAR.PEAK_FALL], fall)


@jitable
def peaks(s: Block) -> None:
    """Peaks of forces on the way to this evaluation: noted apart, and counted where steps are made smaller for them."""
    joints = int(s[HEAD.JOINTS])
    for k in range(int(s[HEAD.N_INTERFACE])):
        j = joints + N_JOINT * k
        above = s[j + JOINT.ABOVE]
        if above <= 0.0:
            continue
        s[j + JOINT.ABOVE] = 0.0
        force = s[j + JOINT.FORCE] + above
        s[j + JOINT.UNSEEN_FORCE] = max(s[j + JOINT.UNSEEN_FORCE], force)
        if s[HEAD.REFINES] != 0.0 and force > s[j + JOINT.FORCE_MAX]:
            s[j + JOINT.FORCE_MAX], s[j + JOINT.FORCE_RISE], s[j + JOINT.FORCE_FALL] = force, 0.0, 0.0
        for end in range(2):
            if end and s[j + JOINT.RIGHT] < 0.0:
                continue
            c = int(s[j + JOINT.CAR]) + N_CAR * end
            mass = s[c + CAR.MASS]
            net = s[c + CAR.NET] + (above if end else -above)
            device = abs(net) / mass
            s[c + CAR.UNSEEN_PEAK] = max(s[c + CAR.UNSEEN_PEAK], device)
            if s[HEAD.REFINES] != 0.0:
                total = abs(net + s[c + CAR.RAIL] + s[c + CAR.SLOPE]) / mass
                s[c + CAR.DEVICE_PEAK] = max(s[c + CAR.DEVICE_PEAK], device)
                s[c + CAR.TOTAL_PEAK] = max(s[c + CAR.TOTAL_PEAK], total)
                if device * mass > s[c + CAR.DEVICE_FORCE]:
                    s[c + CAR.DEVICE_FORCE], s[c + CAR.PEAK_RISE], s[c + CAR.PEAK_FALL] = device * mass, 0.0, 0.0
                    s[c + CAR.PEAK_SWUNG] = s[c + CAR.SWUNG]
                s[c + CAR.TOTAL_FORCE] = max(s[c + CAR.TOTAL_FORCE], total * mass)
