"""Contact windows of a vehicle: the times in which its devices push it away from the impact, and the impulse in each.

The push is the net force of the devices away from the impact. A window begins where it rises above the threshold and
ends where it falls to it again. Between two evaluations the push is linear; at both ends of a window it is followed
outwards as it was inside, as it may jump there.
"""

from __future__ import annotations

from typing import Any

from trainmj.collision.fields import CAR, CONTACT, HEAD, KEPT, LASTING, N_CONTACT
from trainmj.collision.jitable import inlined, jitable

_NONE, _NEW, _OPEN = 0.0, 1.0, 2.0  # CAR.OPEN


@inlined
def follow(s: Any, c: int, car: int, net: float, elapsed: float, time: float) -> None:
    """Begin, lengthen or end the window of a vehicle.

    Args:
        s: the block; CAR.NET still has the force of the evaluation before.
        c: place of the vehicle in it.
        car: index of the vehicle.
        net: force of its devices now, along +x [N].
        elapsed: since the evaluation before [s].
        time: now [s].
    """
    away = 1.0 if car > int(s[HEAD.FRONT]) else -1.0
    before = s[c + CAR.NET]
    if away * net > s[HEAD.THRESHOLD]:
        if s[c + CAR.OPEN] == _OPEN:
            s[c + CAR.OPEN_IMPULSE] += 0.5 * (before + net) * elapsed
        elif s[c + CAR.OPEN] == _NEW:
            _open(s, c, away, net, elapsed, time)
        else:  # where it begins shows when the slope is known
            s[c + CAR.OPEN], s[c + CAR.OPEN_START] = _NEW, time - 0.5 * elapsed
            s[c + CAR.OPEN_IMPULSE] = 0.5 * elapsed * net
    elif s[c + CAR.OPEN] != _NONE:
        _end(s, c, car, away, elapsed, time)
    s[c + CAR.NET_BEFORE] = before


@jitable
def _open(s: Any, c: int, away: float, net: float, elapsed: float, time: float) -> None:
    """A window that began at the evaluation before: its start and impulse, now that its slope is known."""
    before, last = s[c + CAR.NET], time - elapsed
    slope = (net - before) / elapsed
    reach = _reach(away * before - s[HEAD.THRESHOLD], away * slope, 2.0 * (last - s[c + CAR.OPEN_START]))
    s[c + CAR.OPEN], s[c + CAR.OPEN_START] = _OPEN, last - reach
    s[c + CAR.OPEN_IMPULSE] = reach * (before - 0.5 * slope * reach) + 0.5 * (before + net) * elapsed


@jitable
def _end(s: Any, c: int, car: int, away: float, elapsed: float, time: float) -> None:
    """End the window of a vehicle behind the evaluation before, and keep it."""
    before, start, last = s[c + CAR.NET], s[c + CAR.OPEN_START], time - elapsed
    slope = (before - s[c + CAR.NET_BEFORE]) / s[HEAD.ELAPSED] if s[c + CAR.OPEN] == _OPEN else 0.0
    reach = _reach(away * before - s[HEAD.THRESHOLD], -away * slope, elapsed)
    end = last + reach
    impulse = away * (s[c + CAR.OPEN_IMPULSE] + reach * (before + 0.5 * slope * reach))
    mean = impulse / ((end - start) * s[c + CAR.MASS])
    s[c + CAR.OPEN] = _NONE
    count = int(s[c + CAR.CONTACTS])
    s[c + CAR.CONTACTS] += 1.0
    k = int(s[HEAD.CONTACTS]) + N_CONTACT * (KEPT * car + min(count, KEPT - 1))
    if count >= KEPT:  # no place is left: the last one has the worst of the others
        lasting = s[k + CONTACT.END] - s[k + CONTACT.START] >= LASTING
        if end - start < LASTING or (lasting and mean <= s[k + CONTACT.MEAN]):
            return
    s[k + CONTACT.START], s[k + CONTACT.END], s[k + CONTACT.MEAN] = start, end, mean


@jitable
def _reach(above: float, slope: float, width: float) -> float:
    """How long before or behind an evaluation a push was above the threshold [s], of which it is so far above [N].

    The slope [N/s] is that by which it falls outwards; the next evaluation, a width [s] away, is not above. Where the
    slope does not lead down to the threshold within about that width the push jumps, on average in the middle of it.
    """
    if above >= 2.0 * slope * width:
        return 0.5 * width
    return min(above / slope, width)
