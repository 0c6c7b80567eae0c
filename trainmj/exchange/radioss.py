"""A deck as starter and engine file of Radioss, in t (Mg), mm, s and N."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from trainmj.errors import InputError
from trainmj.exchange.deck import Crush, Curve, Deck, Elastic, Friction, Hysteresis, Linear, Spring, header
from trainmj.exchange.writing import FORCE_PER_LENGTH, FORCE_PER_RATE, LENGTH, MASS, fixed

DIFFERENCES = {
    "crush": (
        "H = 2, in compression only. It loads along its curve, which is that of first loading with its climbs "
        "along K, unloads along K and loads again along it, as here. Radioss raises K to the steepest slope "
        "of the curve; no curve of a deck is steeper than its K."
    ),
    "dashpot": (
        "The curve with H = 2, stiff, and behind it K and c as one spring with H = 0 that pushes only, times "
        "1 + c v / F over its rate v (fct_ID21), at least 0, with the mean force F of the curve. Here it is K "
        "e + c v with the elastic stroke e, at least 0 and at most the curve: the same where K e is F. "
        "Pressed again after it has let go a little, it loses half of what it loses here where c v is small "
        "beside F, three quarters where c v is F."
    ),
    "rate": (
        "The curve at rest with H = 2, and beside it H = 0 for what the rate adds: a curve times 1 + g over "
        "the rate (fct_ID21), of 24 points for a formula; before both a stiff contact, which lets go. Here "
        "the climb along K limits what the rate adds, too; in the deck that is whole as soon as the contact "
        "closes. With a dashpot, spring and dashpot take the place of the contact, and the rate is that of "
        "the spring with H = 2 alone."
    ),
    "hysteresis": (
        "H = 7 with loading and unloading curve, and the transition stiffness as K, as here. Behind its "
        "travel both curves are the same, so that the device stands there beside its stop, as here."
    ),
    "hydraulic": (
        "A node as plunger: a stiff contact before it, behind it H = 0 with the orifice over the stroke and "
        "the square of the rate (fct_ID21), and the gas. Here the plunger has no mass and the contact is "
        "rigid; a preload without gas is whole at once, in the deck from 5 mm/s, and 10 N hold a plunger that "
        "nothing brings back."
    ),
    "pull": (
        "H = 2 with the curve in tension, shifted by the slack. It breaks as its curve falls to 0 within "
        "0.001 mm, and carries nothing behind that, as here. With a dashpot it is refused."
    ),
    "end": (
        "Here a collision is not valid from where a curve ends behind which nothing is stated. In the deck its "
        "last part goes on, and nothing says so: compare the strokes with those above."
    ),
    "series": (
        "Two springs with a node of small mass between them, which swings. Here the split at which the forces "
        "are equal is found in every step, and what a snap sets free is lost at once."
    ),
    "friction": (
        "H = 1 to the ground with the constant yield force mu m g, elastic over the first 0.001 mm. Here it "
        "is the friction that would stop the vehicle in the step, up to mu m g."
    ),
    "brake": (
        "In the yield force of the same spring. A brake that is delayed or rises is whole in it from the "
        "start, less a load along the motion that dies away as the brake is applied: the same while the "
        "vehicle goes on or stands, too strong for one that is driven back before the brake is whole."
    ),
    "grade": "/CLOAD of constant force, as here.",
    "body": (
        "Members as linear springs; one that collapses with H = 1, with a linear spring behind it where it "
        "has a dashpot, as here. Nothing says when a member is used up."
    ),
}
"""What Radioss' law is and does differently, by the kinds of a deck."""

_TOKEN = 1e-9  # mass of a spring, which must have one; taken from its nodes [t]
_VERSION = 2022
_OUTPUTS = 2000  # most records of histories
_RULE = "#---1----|----2----|----3----|----4----|----5----|----6----|----7----|----8----|----9----|---10----|"
_FAR = 1.0  # how far a curve goes on where nothing acts [m]

_ABOUT = (
    "Units: Mg (t), mm, s, N. Run it in double precision: strokes are told apart to 1e-6 mm over 1e6 mm.",
    "Written by trainmj. Every node slides along x only. A spring acts between two nodes, its force over",
    "how much closer they are than at the start; nodes stand so far apart that no spring is turned round.",
    "The first nodes are the vehicles; a node named inner, between, plunger or body belongs to a spring, and",
    "its mass is taken from that of its vehicle. Wall and ground do not move; they have a mass as steps are",
    "taken from masses. The engine file holds the step to one that all nodes can bear.",
)
"""What whoever opens a file must know of it, in lines."""


def names(starter: Path) -> tuple[str, Path]:
    """The name of the run and the engine file that belong to a starter file.

    Raises:
        InputError: if that is not named as Radioss wants it.
    """
    found = re.fullmatch(r"([\w.-]{1,72})_0000\.rad", starter.name, flags=re.ASCII)
    if found is None:
        raise InputError(
            f"{starter}: a starter file of Radioss is named NAME_0000.rad, with a NAME of ASCII letters, digits, "
            f"points, - and _, and its engine file NAME_0001.rad: take --out {starter.with_name('run_0000.rad')}"
        )
    return found[1], starter.with_name(f"{found[1]}_0001.rad")


def starter(deck: Deck, run: str) -> str:
    """The starter file of a run of some name."""
    return "\n".join([*_starter(deck, run), "/END", ""])


def engine(deck: Deck, run: str) -> str:
    """The engine file that goes with it."""
    every = max(deck.record, deck.end / _OUTPUTS)
    lines = [
        f"/RUN/{run}/1",
        fixed(deck.end, 20),
        f"/VERS/{_VERSION}",
        "/DT/NODA",
        f"{fixed(0.9, 20)}{fixed(0.0, 20)}",
        "/DTIX",
        f"{fixed(deck.step, 20)}{fixed(deck.step, 20)}",
        "/TFILE",
        fixed(every, 20),
        "/ANIM/DT",
        f"{fixed(0.0, 20)}{fixed(deck.end / 100.0, 20)}",
        "/PRINT/-1000",
    ]
    return "\n".join([*lines, ""])


def _starter(deck: Deck, run: str) -> Iterator[str]:
    yield "#RADIOSS STARTER"
    yield from header(deck, "#", _ABOUT, "Radioss", DIFFERENCES, 92)
    yield "/BEGIN"
    yield run
    yield f"{_VERSION:10d}{0:10d}"
    for _ in range(2):
        yield f"{'Mg':>20}{'mm':>20}{'s':>20}"
    yield "/TITLE"
    yield deck.title[:80]
    yield _RULE
    yield "/NODE"
    for k, node in enumerate(deck.nodes, start=1):
        yield f"#  {node.name}"
        yield f"{k:10d}{fixed(node.x * LENGTH, 20)}{fixed(0.0, 20)}{fixed(0.0, 20)}"
    free, still = [k + 1 for k in deck.free()], [k + 1 for k in deck.fixed()]
    for number, name, nodes, ties in ((1, "along x only", free, "011 111"), (2, "fixed", still, "111 111")):
        yield from _group(number, name, nodes)
        yield f"/BCS/{number}"
        yield name
        yield "#  Tra rot   skew_ID  grnod_ID"
        yield f"   {ties}{0:10d}{number:10d}"
    tokens = np.zeros(len(deck.nodes))
    for spring in deck.springs:
        tokens[[spring.left, spring.right]] += 0.5 * _TOKEN
    group = 2
    for k, node in enumerate(deck.nodes):
        group += 1
        yield from _group(group, node.name, [k + 1])
        yield f"/ADMAS/0/{group}"
        yield node.name
        yield "#               MASS   grnd_ID"
        yield f"{fixed(node.mass * MASS - tokens[k], 20)}{group:10d}"
        if node.speed:
            yield f"/INIVEL/TRA/{group}"
            yield node.name
            yield "#                 Vx                  Vy                  Vz   grnd_ID   skew_ID"
            yield f"{fixed(node.speed * LENGTH, 20)}{fixed(0.0, 20)}{fixed(0.0, 20)}{group:10d}{0:10d}"
    curves = _Curves()
    for number, spring in enumerate(deck.springs, start=1):
        yield from _spring(number, spring, curves)
    for number, load in enumerate(deck.loads, start=1):
        group += 1
        curve = curves.add(load.name, load.curve.x, load.curve.y)
        yield from _group(group, load.name, [load.node + 1])
        yield f"/CLOAD/{number}"
        yield load.name
        yield "#funct_IDT       Dir   skew_ID   sens_ID  grnod_ID                      Ascale_x            Fscale_y"
        yield f"{curve:10d}{'X':>10}{0:10d}{0:10d}{group:10d}{'':10}{fixed(1.0, 20)}{fixed(1.0, 20)}"
    yield from curves.lines
    yield "/TH/NODE/1"
    yield "nodes"
    yield "#     var1      var2      var3"
    yield f"{'DX':<10}{'VX':<10}{'AX':<10}"
    yield from (f"{k:10d}" for k in free)
    yield "/TH/SPRING/2"
    yield "springs"
    yield "#     var1"
    yield f"{'DEF':<10}"
    yield from (f"{k:10d}" for k in range(1, len(deck.springs) + 1))


def _group(number: int, name: str, nodes: list[int]) -> Iterator[str]:
    yield f"/GRNOD/NODE/{number}"
    yield name
    for n in range(0, len(nodes), 10):
        yield "".join(f"{k:10d}" for k in nodes[n : n + 10])


class _Curves:
    """The functions of a file, numbered as they come.

    Attributes:
        lines: of all so far.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._last = 0

    def add(self, name: str, x: np.ndarray, y: np.ndarray) -> int:
        """A function; its number."""
        self._last += 1
        points = (f"{fixed(a, 20)}{fixed(o, 20)}" for a, o in zip(x, y, strict=True))
        self.lines += [f"/FUNCT/{self._last}", name, "#                  X                   Y", *points]
        return self._last

    def extended(self, name: str, curve: Curve) -> int:
        """A curve over the closure, as one over the extension with tension positive."""
        return self.add(name, -curve.x[::-1] * LENGTH, -curve.y[::-1])


def _spring(number: int, spring: Spring, curves: _Curves) -> Iterator[str]:
    """An element with a part and property of its own."""
    k = c = e = 0.0
    force = hardening = rate = unloading = 0
    if isinstance(spring, Linear):
        k, c = spring.stiffness, spring.damping
    elif isinstance(spring, Crush):
        k, hardening = spring.stiffness, 2
        x, y = spring.curve.x * LENGTH, spring.curve.y
        x, y = np.append(-_FAR * LENGTH, x), np.append(0.0, y)
        force = curves.add(spring.name, x, y) if spring.pulls else curves.add(spring.name, -x[::-1], -y[::-1])
    elif isinstance(spring, Elastic):
        k = spring.curve.steepest * (1.0 if spring.rate is None else max(1.0, float(np.abs(spring.rate.y).max())))
        force = curves.extended(spring.name, spring.curve)
        if spring.rate is not None:
            # the force is multiplied by 1 + E g
            e = 1.0
            rate = curves.add(f"{spring.name} over rate", -spring.rate.x[::-1] * LENGTH, spring.rate.y[::-1] - 1.0)
    elif isinstance(spring, Friction):
        k, hardening = spring.stiffness, 1
        at = np.array([spring.force / k, spring.force / k + _FAR])
        over = np.array([spring.force, spring.force + spring.hardening * _FAR])
        force = curves.add(spring.name, np.append(-at[::-1], at) * LENGTH, np.append(-over[::-1], over))
    elif isinstance(spring, Hysteresis):
        k, hardening = spring.stiffness, 7
        force = curves.extended(spring.name, spring.loading)
        unloading = curves.extended(f"{spring.name} unloading", spring.unloading)
    yield _RULE
    yield f"/PART/{number}"
    yield spring.name
    yield "#  prop_ID    mat_ID subset_ID"
    yield f"{number:10d}{0:10d}{0:10d}"
    yield f"/PROP/TYPE4/{number}"
    yield spring.name
    yield "#               Mass                                 sens_ID    Isflag     Ileng"
    yield f"{fixed(_TOKEN, 20)}{'':30}{0:10d}{0:10d}{0:10d}"
    yield "#                 K1                  C1                  A1                  B1                  D1"
    yield f"{fixed(k * FORCE_PER_LENGTH, 20)}{fixed(c * FORCE_PER_RATE, 20)}" + fixed(0.0, 20) * 3
    yield "# fct_ID11        H1  fct_ID21  fct_ID31  fct_ID41                    delta_min1          delta_max1"
    yield f"{force:10d}{hardening:10d}{rate:10d}{unloading:10d}{0:10d}{'':10}{fixed(0.0, 20)}{fixed(0.0, 20)}"
    yield "#                 F1                  E1             Ascale1             Hscale1"
    yield f"{fixed(0.0, 20)}{fixed(e, 20)}{fixed(0.0, 20)}{fixed(0.0, 20)}"
    yield f"/SPRING/{number}"
    yield "#  sprg_ID  node_ID1  node_ID2"
    yield f"{number:10d}{spring.left + 1:10d}{spring.right + 1:10d}"
