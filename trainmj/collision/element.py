"""What acts between two vehicles in a step: one law, or two devices in series, each with its own state.

Two in series carry one force, and their strokes add up to that of the pair. They are brought from one step to the next
from event to event: by no more at once than takes either to the next point of its curve. Between two points both forces
are smooth, so the split at which they are equal is found there, and no peak is passed that the weaker device would not
let the pair reach. Where a device gives way faster than the other can follow, as it shears off, the pair snaps at
constant stroke to the next split at which the forces are equal; what is set free counts as lost, in neither device.

All functions are compiled as they stand, and work on any sequence of numbers.
"""

from __future__ import annotations

import math

from trainmj.collision.fields import ELEMENT, N_ELEMENT, Block
from trainmj.collision.jitable import apart, inlined, jitable
from trainmj.collision.law import CRUSH, FOLLOWED, SERIES, crush, respond
from trainmj.collision.law.curve import ahead, segment

_EVENTS = 1000  # most in a step
_PIECES = 200  # most into which a way is cut that is longer than the step
_TRIALS = 80  # most to find a split
_CLOSE = 1e-12  # forces this close, relative to the larger, are equal
_NOTHING = 1e-2  # and so are forces that differ by less than this [N], what a round-off of strokes may press
_SMALL = 1e-13  # strokes [m]
_SMALL_WAY = 1e-10  # [m], on which nothing that happens matters
_MOST_STOPS = 400  # at bends of the force of a law, on the way of one step
_STOPS = 32  # of a law whose bends are not looked for
_BESIDE = 1e-6  # how far beside a bend the way stops, part of it


@inlined
def advance(s: Block, e: int, stroke: float, rate: float, elapsed: float, time: float) -> tuple[float, float]:
    """Bring an element to the stroke and rate of its interface.

    Returns:
        Its force, positive where it pushes; the largest force on the way.
    """
    if s[e + ELEMENT.BROKEN] != 0.0:
        return 0.0, 0.0
    sign, share = s[e + ELEMENT.SIGN], s[e + ELEMENT.SHARE]
    own, own_rate = share * (sign * stroke - s[e + ELEMENT.START]), share * sign * rate
    before, from_ = s[e + ELEMENT.FORCE], s[e + ELEMENT.STROKE]
    if s[e + ELEMENT.PEAK] != 0.0:
        s[e + ELEMENT.PEAK] = 0.0
    if s[e + ELEMENT.KIND] == CRUSH:  # the most common one, without a call
        force, first, _, lost, viscous = crush.respond(s, e, own, own_rate, elapsed)
        _settle(s, e, own, force, first, lost, viscous, time)
    else:
        lost = _any_other(s, e, own, own_rate, elapsed, time)
        force = s[e + ELEMENT.FORCE]
    if force >= s[e + ELEMENT.BREAK]:  # its spring is lost, and what the mean force has done since the last step
        s[e + ELEMENT.BROKEN] = 1.0
        s[e + ELEMENT.FORCE], s[e + ELEMENT.LATE], s[e + ELEMENT.PEAK] = 0.0, 0.0, s[e + ELEMENT.BREAK]
        s[e + ELEMENT.DISSIPATED] += _break(s, e, before) + 0.5 * before * (own - from_) - lost
        force = 0.0
    return sign * force, s[e + ELEMENT.PEAK]


@apart
def _any_other(s: Block, e: int, stroke: float, rate: float, elapsed: float, time: float) -> float:
    """Bring any element to a stroke and rate; energy lost."""
    if s[e + ELEMENT.KIND] == SERIES:
        return _march(s, e, stroke, elapsed, time)
    if s[e + ELEMENT.KIND] == FOLLOWED:
        return _follow_crush(s, e, stroke, rate, elapsed, time)
    if s[e + ELEMENT.FOLLOWED] != 0.0:
        return _follow(s, e, stroke, rate, elapsed, time)
    return _move(s, e, stroke, rate, elapsed, time)


@jitable
def _follow_crush(s: Block, e: int, stroke: float, rate: float, elapsed: float, time: float) -> float:
    """Bring a crush law to a stroke and rate, through what happens to it on the way; energy lost.

    As long as it stays on one branch of its law and one segment of its curve, its force is linear on the way.
    """
    segment_before, plastic = s[e + ELEMENT.SEGMENT], s[e + ELEMENT.STATE_0]
    s[e + ELEMENT.LATE] = 0.0
    force, first, lost, viscous = _crushed(s, e, stroke, rate, elapsed)
    branch = _branch(s, e, stroke, rate, force, first, plastic)
    turned = branch != s[e + ELEMENT.BRANCH] or s[e + ELEMENT.SEGMENT] != segment_before
    s[e + ELEMENT.BRANCH] = branch
    if not turned or elapsed <= 0.0 or abs(stroke - s[e + ELEMENT.STROKE]) < _SMALL_WAY:
        _settle(s, e, stroke, force, first, lost, viscous, time)
        return lost
    s[e + ELEMENT.SEGMENT] = segment_before
    return _through(s, e, stroke, rate, rate, elapsed, time)


@jitable
def _follow(s: Block, e: int, stroke: float, rate: float, elapsed: float, time: float) -> float:
    """The same for any other law; its force at the end is that at the rate there, not at the mean one of the step."""
    first_before, second_before = s[e + ELEMENT.SEGMENT], s[e + ELEMENT.SEGMENT_2]
    at_end = rate + 0.5 * (rate - s[e + ELEMENT.RATE])
    at_end = at_end if at_end * rate > 0.0 else 0.0
    s[e + ELEMENT.RATE], s[e + ELEMENT.LATE] = rate, 0.0
    force, first, second, lost, viscous = respond(s[e + ELEMENT.KIND], s, e, stroke, at_end, elapsed)
    turned = s[e + ELEMENT.SEGMENT] != first_before or s[e + ELEMENT.SEGMENT_2] != second_before
    turned = turned or (force == 0.0) != (s[e + ELEMENT.FORCE] == 0.0)
    if not turned or elapsed <= 0.0 or abs(stroke - s[e + ELEMENT.STROKE]) < _SMALL_WAY:
        s[e + ELEMENT.STATE_1] = second
        _settle(s, e, stroke, force, first, lost, viscous, time)
        return lost
    s[e + ELEMENT.SEGMENT], s[e + ELEMENT.SEGMENT_2] = first_before, second_before
    return _through(s, e, stroke, rate, at_end, elapsed, time)


@jitable
def _crushed(s: Block, e: int, stroke: float, rate: float, elapsed: float) -> tuple[float, float, float, float]:
    """Force, state and energies lost of a crush law, on a way on which its force is linear."""
    plastic, stiffness = s[e + ELEMENT.STATE_0], s[e + crush.STIFFNESS]
    spring_before = max(0.0, stiffness * (s[e + ELEMENT.STROKE] - plastic))
    before, way = s[e + ELEMENT.FORCE], stroke - s[e + ELEMENT.STROKE]
    force, first, _, lost, at_end = crush.respond(s, e, stroke, rate, elapsed)
    spring = max(0.0, stiffness * (stroke - first))
    stored = 0.5 * (spring + spring_before) * (spring - spring_before) / stiffness
    viscous = 0.5 * (before + force) * (way - (first - plastic)) - stored
    return force, first, lost - at_end + viscous, viscous


@inlined
def _branch(s: Block, e: int, stroke: float, rate: float, force: float, plastic: float, before: float) -> float:
    """On which branch of its law a crush law is, see ELEMENT.BRANCH, when its state has come from one to another."""
    if force == 0.0:
        return 0.0
    if plastic != before:
        return 2.0
    free = s[e + crush.STIFFNESS] * (stroke - plastic) + s[e + crush.DAMPING] * rate
    return 1.0 if force == free else 3.0


@jitable
def _through(s: Block, e: int, stroke: float, rate: float, at_end: float, elapsed: float, time: float) -> float:
    """Bring a law to a stroke in stops on the way; keeps the impulse that the two forces at the ends do not have.

    Crush stops at every bend of its force, between which this is linear; any other law at equal distances.
    """
    start, before = s[e + ELEMENT.STROKE], s[e + ELEMENT.FORCE]
    is_crush = s[e + ELEMENT.KIND] == FOLLOWED
    way = stroke - start
    beside = _BESIDE * way
    at, last = start, before
    mean = most = lost = 0.0
    crosses = True  # with the new rate the force may jump at once
    close = 0.0 if is_crush else 2.0 * _BESIDE  # it may jump at the very end, too
    for n in range(_MOST_STOPS):
        if crosses:
            to = at + 2.0 * beside
        elif is_crush:
            to = _bend(s, e, at, stroke, rate, 2.0 * beside) - beside
        else:
            to = start + way * n / _STOPS
        crosses = is_crush and not crosses
        ends = n == _MOST_STOPS - 1 or (stroke - to) / way <= close
        if ends:
            to = stroke
        part = (to - at) / way
        s[e + ELEMENT.PEAK] = 0.0
        if is_crush:
            force, first, one_lost, viscous = _crushed(s, e, to, rate, elapsed * part)
            s[e + ELEMENT.BRANCH] = _branch(s, e, to, rate, force, first, s[e + ELEMENT.STATE_0])
        else:
            last_rate = at_end if ends else rate
            force, first, second, one_lost, viscous = respond(s[e + ELEMENT.KIND], s, e, to, last_rate, elapsed * part)
            s[e + ELEMENT.STATE_1] = second
        _settle(s, e, to, force, first, one_lost, viscous, time)
        mean += 0.5 * (last + force) * part
        most = max(most, s[e + ELEMENT.PEAK])
        lost += one_lost
        at, last = to, force
        if ends:
            break
    s[e + ELEMENT.PEAK] = most
    s[e + ELEMENT.LATE] = (mean - 0.5 * (before + last)) * elapsed
    return lost


@jitable
def _bend(s: Block, e: int, at: float, stroke: float, rate: float, beside: float) -> float:
    """Where, on the way from one stroke to another, the force of a crush law bends or jumps next.

    That is at a point of its curve, where its spring begins to be pressed or has no force left beside its dashpot, and
    where the two reach the curve. As the force may jump there, the way stops a little before and a little behind it.
    """
    curve = int(s[e + ELEMENT.CURVE])
    k = curve + 3 * segment(s, curve, int(s[e + ELEMENT.SEGMENT]), at)
    plastic, stiffness = s[e + ELEMENT.STATE_0], s[e + crush.STIFFNESS]
    damped = s[e + crush.DAMPING] * rate
    at_zero = s[k + 1] - s[k + 2] * s[k]  # the line of this segment, where it has no stroke
    climbs = stiffness - s[k + 2]
    found = stroke + beside
    found = _nearer(found, s[k + 3] if beside > 0.0 else s[k], at, beside)
    found = _nearer(found, plastic, at, beside)
    found = _nearer(found, plastic - damped / stiffness, at, beside)
    if climbs != 0.0:
        found = _nearer(found, (at_zero + stiffness * plastic) / climbs, at, beside)
        found = _nearer(found, (at_zero + stiffness * plastic - damped) / climbs, at, beside)
    return found


@inlined
def _nearer(found: float, bend: float, at: float, beside: float) -> float:
    """A bend if it is ahead, but not close by, and nearer than another one."""
    return bend if (bend - at) / beside > 1.0 and (found - bend) / beside > 0.0 else found


@jitable
def _move(s: Block, e: int, stroke: float, rate: float, elapsed: float, time: float) -> float:
    """Bring one law to a stroke and rate; energy lost."""
    force, first, second, lost, viscous = respond(s[e + ELEMENT.KIND], s, e, stroke, rate, elapsed)
    s[e + ELEMENT.STATE_1] = second
    _settle(s, e, stroke, force, first, lost, viscous, time)
    return lost


@inlined
def _settle(
    s: Block, e: int, stroke: float, force: float, state: float, lost: float, viscous: float, time: float
) -> None:
    """Keep what a law has answered."""
    s[e + ELEMENT.STATE_0] = state
    s[e + ELEMENT.STROKE], s[e + ELEMENT.FORCE] = stroke, force
    s[e + ELEMENT.DISSIPATED] += lost
    s[e + ELEMENT.VISCOUS] += viscous
    if stroke > s[e + ELEMENT.STROKE_MAX]:
        s[e + ELEMENT.STROKE_MAX] = stroke
        if stroke > s[e + ELEMENT.END] and s[e + ELEMENT.END_TIME] < 0.0:
            s[e + ELEMENT.END_TIME] = time


@jitable
def _march(s: Block, e: int, closing: float, elapsed: float, time: float) -> float:
    """Bring two laws in series to a stroke of the pair; energy lost."""
    a, b = e + N_ELEMENT, e + 2 * N_ELEMENT
    todo = closing - s[e + ELEMENT.STROKE]
    whole = abs(todo)
    lost = -s[a + ELEMENT.DISSIPATED] - s[b + ELEMENT.DISSIPATED]
    viscous = -s[a + ELEMENT.VISCOUS] - s[b + ELEMENT.VISCOUS]
    force, peak = s[e + ELEMENT.FORCE], 0.0
    pressed = 0.0  # stroke since the forces were equal last
    for _ in range(_EVENTS):
        part = min(todo, _room(s, a) + _room(s, b) - 2 * _SMALL)  # neither passes the next point of its curve
        one, move, part, equal = _split(s, a, b, part, elapsed, whole)
        taken = _taken(part, elapsed, whole)
        for law, by in ((one, move), (a + b - one, part - move)):
            pieces = 1 if equal or whole == 0.0 else min(_PIECES, max(1, int(abs(by) / whole)))  # more where it snaps
            start, duration = s[law + ELEMENT.STROKE], taken / pieces
            rate = by / taken if taken > 0.0 else 0.0
            for n in range(pieces):
                before = s[law + ELEMENT.FORCE]
                if n + 1 < pieces:  # at rest on the way: how fast it snaps is not known
                    _move(s, law, start + by * (n + 1) / pieces, 0.0, duration, time)
                else:
                    _move(s, law, start + by, rate, duration, time)
                lost -= 0.5 * (before + s[law + ELEMENT.FORCE]) * by / pieces
        todo -= part
        pressed += part
        if equal:
            now = min(s[a + ELEMENT.FORCE], s[b + ELEMENT.FORCE])
            lost += 0.5 * (force + now) * pressed
            force, pressed = now, 0.0
            peak = max(peak, force)
            if abs(todo) <= _SMALL:
                break
    lost += s[a + ELEMENT.DISSIPATED] + s[b + ELEMENT.DISSIPATED]
    viscous += s[a + ELEMENT.VISCOUS] + s[b + ELEMENT.VISCOUS]
    s[e + ELEMENT.STROKE] = closing if abs(todo) <= _SMALL else closing - todo  # what is left over, the next step takes
    s[e + ELEMENT.FORCE], s[e + ELEMENT.PEAK] = force, peak
    s[e + ELEMENT.STROKE_MAX] = max(s[e + ELEMENT.STROKE_MAX], closing)
    s[e + ELEMENT.DISSIPATED] += lost
    s[e + ELEMENT.VISCOUS] += viscous
    return lost


@jitable
def _room(s: Block, e: int) -> float:
    """From the stroke of a law to the next point of its curve, which moves with what the car body gives way."""
    curve, stroke = int(s[e + ELEMENT.CURVE]), s[e + ELEMENT.STROKE] - s[e + ELEMENT.STATE_1]
    return ahead(s, curve, segment(s, curve, int(s[e + ELEMENT.SEGMENT]), stroke + 2 * _SMALL)) - stroke


@jitable
def _split(s: Block, a: int, b: int, part: float, elapsed: float, whole: float) -> tuple[int, float, float, bool]:
    """How far one of two laws moves where both together move by a part, at most.

    The one with less force gives way, as far as to just before the next point of its curve.

    Args:
        s: the block.
        a: place of the first law.
        b: place of the second.
        part: by which the pair moves [m].
        elapsed: duration of the whole step [s].
        whole: by which the pair moves in the whole step [m].

    Returns:
        The place of a law and how far it moves, to the last digit, as its force may jump there; the part by which the
        pair moves until the forces are equal, or one law comes to a point; whether they are equal then.
    """
    room_a, room_b = _room(s, a) - _SMALL, _room(s, b) - _SMALL
    start = min(room_a, max(part - room_b, 0.5 * part))
    short, force = _short(s, a, b, start, part, elapsed, whole)
    if abs(short) <= _close(force):
        return a, start, part, True
    gives, other, room = (a, b, room_a) if short > 0.0 else (b, a, room_b)
    low = high = start if short > 0.0 else part - start
    low_short = high_short = abs(short)
    by = max(abs(part), _SMALL)
    while high_short > _close(force) and high < room:
        low, low_short = high, high_short
        high = min(high + by, room)
        by *= 2.0
        high_short, force = _short(s, gives, other, high, part, elapsed, whole)
    if high_short > _close(force):  # it comes to a point of its curve first: how far the pair has moved by then
        used = _used(s, gives, other, room, part, elapsed, whole)
        if used <= 0.0:  # it gives way faster than the other one can follow
            used = min(part, 0.0)
            return gives, room, used, False
        return gives, room, used, True
    if force <= _NOTHING:  # without force both are equal anywhere: where the other one has just let go
        for _ in range(_TRIALS):
            middle = 0.5 * (low + high)
            short, force = _short(s, gives, other, middle, part, elapsed, whole)
            if short > _close(force):
                low = middle
            else:
                high = middle
        return gives, high, part, True
    stayed, weight_low, weight_high = 0, 1.0, 1.0
    for _ in range(_TRIALS):  # regula falsi, which halves the weight of an end that stays (Illinois)
        if high_short >= -_close(force):
            return gives, high, part, True
        if abs(high - low) <= 1e-17:
            break
        weighed = weight_low * low_short
        move = low + weighed * (high - low) / (weighed - weight_high * high_short)
        short, force = _short(s, gives, other, move, part, elapsed, whole)
        if short > _close(force):
            low, low_short, weight_low = move, short, 1.0
            weight_high *= 0.5 if stayed > 0 else 1.0
            stayed = 1
        else:
            high, high_short, weight_high = move, short, 1.0
            weight_low *= 0.5 if stayed < 0 else 1.0
            stayed = -1
    # the force of one law jumps here: it carries what the other one does, and stays on the side where it can
    short, force = _short(s, gives, other, low, part, elapsed, whole)
    least_low = force - abs(short)
    short, force = _short(s, gives, other, high, part, elapsed, whole)
    return gives, low if least_low > force - abs(short) else high, part, True


@jitable
def _used(s: Block, gives: int, other: int, room: float, part: float, elapsed: float, whole: float) -> float:
    """The part that a pair has moved when one law has moved by its room, their forces equal; 0 if it snaps before."""
    if part <= 0.0:
        return 0.0
    low, high = 0.0, part  # at the high end the other one carries more
    high_short, _ = _short(s, gives, other, room, high, elapsed, whole)
    low_short, force = _short(s, gives, other, room, 1e-9 * part, elapsed, whole)
    if low_short > _close(force):
        return 0.0
    if force <= _NOTHING:  # without force both are equal anywhere: until the other one carries some
        for _ in range(_TRIALS):
            middle = 0.5 * (low + high)
            short, force = _short(s, gives, other, room, middle, elapsed, whole)
            if short > _close(force):
                high = middle
            else:
                low = middle
        return low
    stayed, weight_low, weight_high = 0, 1.0, 1.0
    for _ in range(_TRIALS):
        if high_short <= _close(force) or high - low <= 1e-17:
            break
        weighed = weight_high * high_short
        used = high - weighed * (high - low) / (weighed - weight_low * low_short)
        short, force = _short(s, gives, other, room, used, elapsed, whole)
        if short > _close(force):
            high, high_short, weight_high = used, short, 1.0
            weight_low *= 0.5 if stayed > 0 else 1.0
            stayed = 1
        elif short >= -_close(force):
            return used
        else:
            low, low_short, weight_low = used, short, 1.0
            weight_high *= 0.5 if stayed < 0 else 1.0
            stayed = -1
    return high


@jitable
def _close(force: float) -> float:
    """Difference of two forces, the larger of which is given, that counts as none [N]."""
    return _NOTHING + _CLOSE * force


@jitable
def _short(
    s: Block, one: int, other: int, move: float, part: float, elapsed: float, whole: float
) -> tuple[float, float]:
    """By how much the force of one law is below that of the other where it moves, and the larger of the two [N]."""
    first = _trial(s, one, move, part, elapsed, whole)
    second = _trial(s, other, part - move, part, elapsed, whole)
    return second - first, max(first, second)


@jitable
def _trial(s: Block, e: int, move: float, part: float, elapsed: float, whole: float) -> float:
    """Force of a law, were it to move while the pair moves by a part of the whole step."""
    taken = _taken(part, elapsed, whole)
    rate = move / taken if taken > 0.0 else 0.0
    return respond(s[e + ELEMENT.KIND], s, e, s[e + ELEMENT.STROKE] + move, rate, taken)[0]


@jitable
def _taken(part: float, elapsed: float, whole: float) -> float:
    """How long a part of a step takes; all of it where the pair does not move."""
    return elapsed * abs(part) / whole if part != 0.0 and whole > 0.0 else elapsed


@jitable
def _break(s: Block, e: int, force: float) -> float:
    """Energy that the springs of an element lose with a force; each of two in series has lost its own."""
    if s[e + ELEMENT.KIND] != SERIES:
        return 0.5 * force * force / s[e + ELEMENT.P0]
    found = 0.0
    for law in (e + N_ELEMENT, e + 2 * N_ELEMENT):
        spring = 0.5 * force * force / s[law + ELEMENT.P0]
        s[law + ELEMENT.DISSIPATED] += spring
        s[law + ELEMENT.FORCE] = 0.0
        found += spring
    return found


@jitable
def narrowest(s: Block, e: int, stroke: float, rate: float, reach: float) -> float:
    """Width of the narrowest part of the curves of an element within a reach ahead of its stroke; infinite for none.

    A jump counts as wide as the climb along the stiffness that follows it.
    """
    sign, share = s[e + ELEMENT.SIGN], s[e + ELEMENT.SHARE]
    own, found = share * (sign * stroke - s[e + ELEMENT.START]), 1e9
    if s[e + ELEMENT.BROKEN] != 0.0 or sign * rate <= 0.0:
        return found
    laws = (e + N_ELEMENT, e + 2 * N_ELEMENT) if s[e + ELEMENT.KIND] == SERIES else (e, e)
    for law in laws:
        at = (s[law + ELEMENT.STROKE] if s[e + ELEMENT.KIND] == SERIES else own) - s[law + ELEMENT.STATE_1]
        curve = int(s[law + ELEMENT.CURVE])
        here = curve + 3 * segment(s, curve, int(s[law + ELEMENT.SEGMENT]), at)
        while s[here + 3] != math.inf and s[here] < at + share * reach:
            width = s[here + 3] - s[here]
            if width == 0.0:
                width = abs(s[here + 4] - s[here + 1]) / s[law + ELEMENT.P0]
            found = min(found, width / share)
            here += 3
    return found
