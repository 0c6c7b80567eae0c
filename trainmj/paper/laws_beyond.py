"""The laws that the paper concludes, as rules that can be judged anywhere: on five collisions around a condition.

The paper found them for 20 mm <= D <= 50 mm, 30 t <= M <= 36 t, 25 km/h and vehicles of one mass. A condition is a D,
masses and a speed; around it D varies by as much as in the paper, and all masses by as many tonnes on their mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.collision.summary import Summary
from trainmj.paper.printed import LIMIT_ACCELERATION_G, LIMIT_OTHERS_MM, STRONG, published

HALF_D_MM, HALF_M_T = 15.0, 3.0
"""Half of the paper's ranges of D and M."""

COUPLER_MM = float(published("3")["coupler_mm"].min())
"""Stroke of the coupler of the front when it is used up."""

HARDLY_MM = 2.0
HARDLY_PERCENT = 1.5
"""Changes below which strokes and peak accelerations hardly change, as inside the paper's range."""

N = 6  # vehicles and interfaces of the moving train


@dataclass(frozen=True)
class Around:
    """Five collisions: one condition, and D and M below and above it."""

    over_D: tuple[Summary, Summary, Summary]  # rising D, the condition in the middle
    over_M: tuple[Summary, Summary, Summary]  # rising M, likewise
    speed_km_h: float

    @property
    def mid(self) -> Summary:
        """The condition itself."""
        return self.over_D[1]

    @property
    def all(self) -> tuple[Summary, ...]:
        """Each of the five once."""
        return (*self.over_D, self.over_M[0], self.over_M[2])


@dataclass(frozen=True)
class Rule:
    """A law with the rule by which it is judged."""

    section: str  # where the paper states it
    statement: str
    rule: str
    judge: Callable[[Around], tuple[bool, str]]  # whether it holds, and the numbers that show it
    why: str = ""  # why it breaks, where that does not depend on what devices do


def s_anti(s: Summary) -> float:
    """Largest stroke of the anti-climber [mm]."""
    return s.interfaces[0].stages[1].stroke_mm


def used_up(s: Summary) -> bool:
    """Whether the coupler of the front is used up and sheared off."""
    return s.interfaces[0].stages[0].stroke_mm >= COUPLER_MM - 0.05


def strokes(s: Summary) -> Array:
    """S_anti, S12, S23 and the strokes of the last three interfaces of the moving train [mm]."""
    return np.array([s_anti(s), *(i.stroke_mm for i in s.interfaces[1:N])])


def _peaks(s: Summary) -> Array:
    return np.array([v.peak_device_acceleration_g for v in s.vehicles[:N]])


_STROKES = ("S_anti", "S12", "S23")
_BY_MASS = "momentum shares the speed by the masses of the trains"
_WHY = {
    ("S12", "D"): "D is not between the turns of S12",
    ("S23", "M"): "S23 is least just above shear-off",
}
_VALUES: dict[str, tuple[Callable[[Summary], float], str, int]] = {
    "S_anti": (s_anti, "mm", 1),
    "S12": (lambda s: s.interfaces[1].stroke_mm, "mm", 1),
    "S23": (lambda s: s.interfaces[2].stroke_mm, "mm", 1),
    "TS": (lambda s: s.TS_mm, "mm", 1),
    "TAMA": (lambda s: s.TAMA_g, "g", 4),
    "balance time of M1": (lambda s: s.vehicles[0].balance_time_s, "s", 3),
    "balance time of M2": (lambda s: s.vehicles[1].balance_time_s, "s", 3),
    "balance time of M3": (lambda s: s.vehicles[2].balance_time_s, "s", 3),
}
_TRENDS = (
    ("5.1", "S_anti", "D", "grows"),
    ("5.1", "S12", "D", "grows"),
    ("5.1", "S23", "D", "falls"),
    ("5.2", "balance time of M1", "D", "grows"),
    ("5.2", "balance time of M2", "D", "grows"),
    ("5.3", "TS", "D", "falls"),
    ("6.1", "S_anti", "M", "grows"),
    ("6.1", "S12", "M", "grows"),
    ("6.1", "S23", "M", "grows"),
    ("6.2", "balance time of M1", "M", "grows"),
    ("6.2", "balance time of M2", "M", "grows"),
    ("6.2", "balance time of M3", "M", "grows"),
    ("6.3", "TS", "M", "grows"),
    ("6.3", "TAMA", "M", "falls"),
)


def _rules() -> Iterator[Rule]:
    rule = "0.5 within 0.05; rail friction takes the rest"
    yield Rule("3.2", "Half of the kinetic energy is absorbed", "0.5 within 0.05", _absorbed, _BY_MASS)
    yield Rule("3.2", "The final speed is about half of the initial one", rule, _half, _BY_MASS)
    rule = "moving and standing train within 1 % of the stroke of S1-M1"
    yield Rule(
        "3.2",
        "Strokes are symmetrical about S1-M1",
        rule,
        _symmetrical,
        "trains of different masses take up different energies",
    )
    yield Rule("3.2", "S1-M1 has the largest stroke", "twice that of one train, above every other", _largest)
    yield Rule("3.2", "The first three interfaces absorb most of the energy", "above 90 % of the train's", _first_three)
    yield Rule("3.2", "Strokes decrease from S1-M1 towards the ends", "each below the one before it", _decrease)
    rule = "in all five collisions"
    yield Rule("5.1, 6.1", "The coupler of the front is used up and sheared off", rule, _sheared)
    for section, name, factor, way in _TRENDS:
        statement = f"{name[0].upper()}{name[1:]} {way} with {factor}"
        rule = "the larger value against the smaller one"
        why = _WHY.get((name, factor), "")
        yield Rule(section, statement, rule, partial(_trend, name=name, factor=factor, way=way), why)
    yield Rule("5.3", "TAMA hardly changes with D", "by less than 1 %", _same_TAMA)
    for section, factor, order in (("5.1", "D", ("S23", "S_anti", "S12")), ("6.1", "M", ("S_anti", "S23", "S12"))):
        statement = f"{factor} changes {order[0]} most, then {order[1]}, then {order[2]}"
        yield Rule(section, statement, "relative changes", partial(_order, factor=factor, order=order))
        statement = f"Strokes of the last three interfaces hardly change with {factor}"
        yield Rule(section, statement, f"each by less than {HARDLY_MM:g} mm", partial(_last_three, factor=factor))
    rule = f"each by less than {HARDLY_PERCENT:g} %"
    yield Rule("5.2", "Peak accelerations do not depend on D", rule, _same_peaks)
    rule = "mass times peak by less than 3 %, for each vehicle"
    yield Rule("6.2", "Peak accelerations fall with M, as 1/M", rule, _force)
    rule = f"|r| of {STRONG:g} or more over the five collisions"
    yield Rule("7", "M is strongly correlated with all responses", rule, _strong_M)
    rule = f"|r| of {STRONG:g} or more, and the largest of the seven"
    yield Rule("7", "D is correlated with S23 most of all", rule, _strong_D)
    largest = f"below {LIMIT_ACCELERATION_G:g} g in all five collisions"
    yield Rule(
        "8.2", "Peak accelerations stay below the limit", largest, _below_limit, "the same forces on lighter vehicles"
    )
    largest = f"below {LIMIT_OTHERS_MM:g} mm in all five collisions"
    yield Rule(
        "8.2", "Couplers behind the front stay below their limit", largest, _couplers, "their design stroke is used up"
    )


def _over(a: Around, factor: str) -> tuple[Summary, Summary, Summary]:
    return a.over_D if factor == "D" else a.over_M


def _trend(a: Around, name: str, factor: str, way: str) -> tuple[bool, str]:
    value, unit, digits = _VALUES[name]
    first, last = (value(s) for s in _over(a, factor)[::2])
    holds = last > first if way == "grows" else last < first
    return holds, f"{first:.{digits}f} to {last:.{digits}f} {unit}"


def _largest(a: Around) -> tuple[bool, str]:
    front, others = 2 * a.mid.interfaces[0].stroke_mm, strokes(a.mid)[1:]
    return bool(front > others.max()), f"{front:.0f} mm, the next {others.max():.0f} mm"


def _first_three(a: Around) -> tuple[bool, str]:
    energies = [i.energy_kJ for i in a.mid.interfaces[:N]]
    share = sum(energies[:3]) / sum(energies)
    return share > 0.9, f"{100 * share:.1f} %"


def _shares(a: Around) -> tuple[float, float, float]:
    """Final speed over the initial one, absorbed over kinetic energy, and the moving train's share of the mass."""
    mass = np.array([v.mass_t for v in a.mid.vehicles])
    final = float(mass @ [v.final_speed_km_h for v in a.mid.vehicles] / mass.sum())
    balance = a.mid.balance
    absorbed = (balance.absorbed_kJ + balance.elastic_kJ) / balance.kinetic_start_kJ
    return final / a.speed_km_h, absorbed, float(mass[:N].sum() / mass.sum())


def _half(a: Around) -> tuple[bool, str]:
    final, _, own = _shares(a)
    return abs(final - 0.5) < 0.05, f"{final:.3f}; without friction {own:.3f}"


def _absorbed(a: Around) -> tuple[bool, str]:
    _, absorbed, own = _shares(a)
    return abs(absorbed - 0.5) < 0.05, f"{absorbed:.3f}; without friction {1 - own:.3f}"


def _symmetrical(a: Around) -> tuple[bool, str]:
    moving, standing = ([i.stroke_mm for i in side] for side in (a.mid.interfaces[1:N], a.mid.interfaces[-N + 1 :]))
    off = float(np.abs(np.subtract(moving, standing)).max())
    return off < 0.01 * 2 * a.mid.interfaces[0].stroke_mm, f"differ by {off:.1f} mm"


def _decrease(a: Around) -> tuple[bool, str]:
    each = [2 * a.mid.interfaces[0].stroke_mm, *strokes(a.mid)[1:]]
    return bool((np.diff(each) < 0).all()), ", ".join(f"{s:.0f}" for s in each) + " mm"


def _same_TAMA(a: Around) -> tuple[bool, str]:
    first, mid, last = (s.TAMA_g for s in a.over_D)
    change = 100 * (max(first, mid, last) - min(first, mid, last)) / mid
    return change < 1, f"by {change:.2f} %"


def _sheared(a: Around) -> tuple[bool, str]:
    least = min(s.interfaces[0].stages[0].stroke_mm for s in a.all)
    return all(map(used_up, a.all)), f"{least:.1f} mm at least"


def _order(a: Around, factor: str, order: Sequence[str]) -> tuple[bool, str]:
    first, _, last = (strokes(s)[:3] for s in _over(a, factor))
    if first.min() == 0.0:
        return False, f"no stroke at {_STROKES[int(first.argmin())]}"
    change = dict(zip(_STROKES, 100 * (last / first - 1), strict=True))
    found = sorted(change, key=lambda name: -abs(change[name]))
    return found == list(order), ", ".join(f"{name} {change[name]:+.1f} %" for name in found)


def _last_three(a: Around, factor: str) -> tuple[bool, str]:
    change = np.ptp([strokes(s)[3:] for s in _over(a, factor)], axis=0)
    return bool(change.max() < HARDLY_MM), ", ".join(f"{c:.2f}" for c in change) + " mm"


def _same_peaks(a: Around) -> tuple[bool, str]:
    peaks = np.array([_peaks(s) for s in a.over_D])
    change = 100 * np.ptp(peaks, axis=0) / peaks[1]
    at = int(change.argmax())
    return bool(change.max() < HARDLY_PERCENT), f"M{at + 1} by {change[at]:.2f} %"


def _force(a: Around) -> tuple[bool, str]:
    force = np.array([[v.mass_t * v.peak_device_acceleration_g for v in s.vehicles[:N]] for s in a.over_M])
    spread = 100 * np.ptp(force, axis=0) / force[1]
    at = int(spread.argmax())
    return bool(spread.max() < 3), f"M{at + 1} by {spread[at]:.2f} %"


def _correlations(a: Around) -> dict[str, tuple[float, float]]:
    """Pearson's r of D and of M with the seven responses of Table 10."""
    D, M = np.array([-1.0, 0, 1, 0, 0]), np.array([0.0, 0, 0, -1, 1])
    y = np.array([[*strokes(s)[:3], *_peaks(s)[:2], s.TS_mm, s.TAMA_g] for s in a.all])
    names = (*_STROKES, "peak of M1", "peak of M2", "TS", "TAMA")
    moved = np.ptp(y, axis=0) > 1e-9 * np.abs(y).max(axis=0)
    r = np.zeros((2, len(names)))
    r[:, moved] = [[np.corrcoef(x, column)[0, 1] for column in y[:, moved].T] for x in (D, M)]
    return {name: (float(r[0, k]), float(r[1, k])) for k, name in enumerate(names)}


def _strong_M(a: Around) -> tuple[bool, str]:
    weak = {name: r for name, (_, r) in _correlations(a).items() if abs(r) < STRONG}
    return not weak, ", ".join(f"{name} {r:+.2f}" for name, r in weak.items()) or "all"


def _strong_D(a: Around) -> tuple[bool, str]:
    r = {name: of_D for name, (of_D, _) in _correlations(a).items()}
    first, second = sorted(r, key=lambda name: -abs(r[name]))[:2]
    return first == "S23" and abs(r[first]) >= STRONG, f"{first} {r[first]:+.2f}, {second} {r[second]:+.2f}"


def _below_limit(a: Around) -> tuple[bool, str]:
    largest = max(float(_peaks(s).max()) for s in a.all)
    return largest < LIMIT_ACCELERATION_G, f"largest {largest:.2f} g"


def _couplers(a: Around) -> tuple[bool, str]:
    largest = max(float(strokes(s)[1:].max()) for s in a.all)
    return largest <= LIMIT_OTHERS_MM, f"largest {largest:.1f} mm"


RULES = tuple(_rules())
"""All of them."""
