"""A deck as a keyword file of LS-DYNA, in t, mm, s and N."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trainmj.exchange.deck import Crush, Curve, Deck, Elastic, Friction, Linear, Spring, header
from trainmj.exchange.writing import FORCE_PER_LENGTH, FORCE_PER_RATE, LENGTH, MASS, fixed

DIFFERENCES = {
    "crush": (
        "*MAT_S08, in compression only. It loads along its curve, which is that of first loading with its "
        "climbs along K, unloads along KU = K and loads again along it, as here. LS-DYNA takes the steepest "
        "slope of the curve for KU if that is larger; no curve of a deck is steeper than its KU."
    ),
    "dashpot": (
        "The curve as *MAT_S08, stiff, and behind it K and c as one *MAT_S04: a spring that pushes only, "
        "times a factor over its rate v (LCR) of 1 + c v / F, at least 0, with the mean force F of the curve. "
        "Here it is K e + c v with the elastic stroke e, at least 0 and at most the curve: the same where K e "
        "is F. Pressed again after it has let go a little, it loses half of what it loses here where c v is "
        "small beside F, three quarters where c v is F."
    ),
    "rate": (
        "The curve at rest as *MAT_S08, and beside it *MAT_S04 for what the rate adds: a curve times a factor "
        "over the rate (LCR), of 24 points for a formula; before both a stiff contact, which lets go. Here "
        "the climb along K limits what the rate adds, too; in the deck that is whole as soon as the contact "
        "closes. With a dashpot, spring and dashpot take the place of the contact, and the rate is that of "
        "the *MAT_S08 alone."
    ),
    "hysteresis": (
        "*MAT_S01 with the transition stiffness, and behind it two *MAT_S04: the mean of loading and "
        "unloading curve, and half their difference times a factor over the rate of slip (LCR) that goes from "
        "-1 to 1 within 20 mm/s. Here slip begins at the curves; in the deck the force creeps to their mean "
        "at rest. Behind its travel both curves are the same, so that the device stands there beside its "
        "stop, as here."
    ),
    "hydraulic": (
        "A node as plunger: a stiff contact before it, behind it *MAT_S04 with the orifice over the stroke "
        "and the square of the rate (LCR), and the gas. Here the plunger has no mass and the contact is "
        "rigid; a preload without gas is whole at once, in the deck from 5 mm/s, and 10 N hold a plunger that "
        "nothing brings back."
    ),
    "pull": (
        "*MAT_S08 with CTF = -1, shifted by the slack. It breaks as its curve falls to 0 within 0.001 mm, and "
        "carries nothing behind that, as here. With a dashpot it is refused."
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
        "*MAT_S03 to the ground with KT = 0 and FY = mu m g, elastic over the first 0.001 mm. Here it is the "
        "friction that would stop the vehicle in the step, up to mu m g."
    ),
    "brake": (
        "In FY of the same spring. A brake that is delayed or rises is whole in FY from the start, less a "
        "load along the motion that dies away as the brake is applied: the same while the vehicle goes on or "
        "stands, too strong for one that is driven back before the brake is whole."
    ),
    "grade": "*LOAD_NODE_POINT of constant force, as here.",
    "body": (
        "Members as *MAT_S01 and *MAT_S02; one that collapses as *MAT_S03, with both behind it where it has a "
        "dashpot, as here. Nothing says when a member is used up."
    ),
}
"""What LS-DYNA's law is and does differently, by the kinds of a deck."""

_CURVE_STEPS = (1000, 200_000)  # fewest and most intervals of a curve, which LS-DYNA divides evenly
_PER_PART = 10.0  # intervals in the narrowest part of a curve
_OUTPUTS = 2000  # most records of histories
_AXIS = 1  # id of the direction x

_ABOUT = (
    "Units: t, mm, s, N. Run it in double precision: strokes are told apart to 1e-6 mm over 1e6 mm.",
    "Written by trainmj. Every node slides along x only. A spring acts between two nodes, its force over",
    "how much closer they are than at the start; where the nodes stand is for pictures. The first nodes are",
    "the vehicles; a node named inner, between, plunger or body belongs to a spring, and its mass is taken",
    "from that of its vehicle. Wall and ground do not move; they have a mass as steps are taken from masses.",
    "The step (*CONTROL_TIMESTEP, LCTM) is one that all of them can bear.",
)
"""What whoever opens a file must know of it, in lines."""


def written(deck: Deck) -> str:
    """The keyword file."""
    return "\n".join([*header(deck, "$", _ABOUT, "LS-DYNA", DIFFERENCES, 96), "*KEYWORD", *_body(deck), "*END", ""])


def _body(deck: Deck) -> Iterator[str]:
    yield "*TITLE"
    yield deck.title[:80]
    yield from _control(deck)
    yield "*NODE"
    yield "$#   nid               x               y               z      tc      rc"
    for k, node in enumerate(deck.nodes, start=1):
        yield f"$ {node.name}"
        yield f"{k:8d}{fixed(node.x * LENGTH, 16)}{0.0:16.1f}{0.0:16.1f}{0:8d}{0:8d}"
    yield "*BOUNDARY_SPC_NODE"
    yield "$#     nid       cid      dofx      dofy      dofz     dofrx     dofry     dofrz"
    for k, node in enumerate(deck.nodes, start=1):
        yield f"{k:10d}{0:10d}{int(node.fixed):10d}" + f"{1:10d}" * 5
    yield "*ELEMENT_MASS"
    yield "$#   eid     nid            mass     pid"
    for k, node in enumerate(deck.nodes, start=1):
        yield f"{k:8d}{k:8d}{fixed(node.mass * MASS, 16)}{0:8d}"
    moving = [k for k in deck.free() if deck.nodes[k].speed]
    if moving:
        yield "*INITIAL_VELOCITY_NODE"
        yield "$#     nid        vx        vy        vz       vxr       vyr       vzr      icid"
        for k in moving:
            yield f"{k + 1:10d}{fixed(deck.nodes[k].speed * LENGTH, 10)}" + f"{0.0:10.1f}" * 5 + f"{0:10d}"
    yield "*DEFINE_SD_ORIENTATION"
    yield "$#     vid       iop        xt        yt        zt      nid1      nid2"
    yield f"{_AXIS:10d}{0:10d}{1.0:10.1f}{0.0:10.1f}{0.0:10.1f}{0:10d}{0:10d}"
    curves = _Curves()
    element = 0
    for spring in deck.springs:
        for words, material in _materials(spring, curves):
            element += 1
            yield from _spring(element, spring, words, material)
    for load in deck.loads:
        yield "*LOAD_NODE_POINT"
        yield f"$ {load.name}"
        yield "$#     nid       dof      lcid        sf       cid        m1        m2        m3"
        curve = curves.add(load.name, load.curve, 1.0, 1.0)
        yield f"{load.node + 1:10d}{1:10d}{curve:10d}{1.0:10.1f}" + f"{0:10d}" * 4
    step = Curve(np.array([0.0, 2.0 * deck.end]), np.full(2, deck.step))
    curves.add("largest step", step, 1.0, 1.0, _STEP_CURVE)
    yield from curves.lines


def _control(deck: Deck) -> Iterator[str]:
    yield "*CONTROL_TERMINATION"
    yield "$#  endtim    endcyc     dtmin    endeng    endmas     nosol"
    yield f"{fixed(deck.end, 10)}{0:10d}{0.0:10.1f}{0.0:10.1f}{0.0:10.1f}{0:10d}"
    yield "*CONTROL_TIMESTEP"
    yield "$#  dtinit    tssfac      isdo    tslimt     dt2ms      lctm     erode     ms1st"
    yield (f"{fixed(deck.step, 10)}{0.9:10.1f}{0:10d}{0.0:10.1f}{0.0:10.1f}{_STEP_CURVE:10d}{0:10d}{0:10d}")
    yield "*CONTROL_ENERGY"
    yield "$#    hgen      rwen    slnten     rylen"
    yield f"{1:10d}{2:10d}{1:10d}{1:10d}"
    every = fixed(max(deck.record, deck.end / _OUTPUTS), 10)
    for name in ("GLSTAT", "NODOUT", "DEFORC", "SPCFORC"):
        yield f"*DATABASE_{name}"
        yield "$#      dt    binary      lcur     ioopt"
        yield f"{every}{0:10d}{0:10d}{1:10d}"
    yield "*DATABASE_BINARY_D3PLOT"
    yield "$#      dt      lcdt      beam     npltc    psetid"
    yield f"{fixed(deck.end / 100.0, 10)}{0:10d}{0:10d}{0:10d}{0:10d}"
    yield "*DATABASE_HISTORY_NODE"
    yield "$#     id1       id2       id3       id4       id5       id6       id7       id8"
    free = [k + 1 for k in deck.free()]
    for n in range(0, len(free), 8):
        row = free[n : n + 8]
        yield "".join(f"{k:10d}" for k in row)


_STEP_CURVE = 1


class _Curves:
    """The curves of a file, numbered as they come.

    Attributes:
        lines: of all so far.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._last = _STEP_CURVE

    def add(self, name: str, curve: Curve, x: float, y: float, number: int | None = None) -> int:
        """A curve whose values are multiplied by x and y; its number."""
        if number is None:
            self._last += 1
            number = self._last
        width = float(np.diff(curve.x).min())
        steps = int(np.clip(np.ceil(_PER_PART * float(np.ptp(curve.x)) / width), *_CURVE_STEPS))
        self.lines += [
            "*DEFINE_CURVE_TITLE",
            name,
            "$#    lcid      sidr       sfa       sfo      offa      offo    dattyp     lcint",
            f"{number:10d}{0:10d}{1.0:10.1f}{1.0:10.1f}{0.0:10.1f}{0.0:10.1f}{0:10d}{steps:10d}",
            "$#                a1                  o1",
            *(f"{fixed(a * x, 20)}{fixed(o * y, 20)}" for a, o in zip(curve.x, curve.y, strict=True)),
        ]
        return number


def _materials(spring: Spring, curves: _Curves) -> Iterator[tuple[str, list[str]]]:
    """The materials of a spring, each with a word for its part, and its lines behind the id."""
    if isinstance(spring, Linear):
        yield "spring", ["*MAT_SPRING_ELASTIC", "         k", fixed(spring.stiffness * FORCE_PER_LENGTH, 10)]
        if spring.damping:
            yield "dashpot", ["*MAT_DAMPER_VISCOUS", "        dc", fixed(spring.damping * FORCE_PER_RATE, 10)]
    elif isinstance(spring, Crush):
        curve = curves.add(spring.name, spring.curve, LENGTH, 1.0)
        values = f"{curve:10d}{fixed(spring.stiffness * FORCE_PER_LENGTH, 10)}{-1.0 if spring.pulls else 1.0:10.1f}"
        yield "crush", ["*MAT_SPRING_INELASTIC", "      lcfd        ku       ctf", values]
    elif isinstance(spring, Elastic):
        yield "spring", _nonlinear(spring.name, spring.curve, spring.rate, curves)
    elif isinstance(spring, Friction):
        k, tangent = spring.stiffness * FORCE_PER_LENGTH, spring.hardening * FORCE_PER_LENGTH
        values = f"{fixed(k, 10)}{fixed(tangent, 10)}{fixed(spring.force, 10)}"
        yield "slider", ["*MAT_SPRING_ELASTOPLASTIC", "         k        kt        fy", values]


def _nonlinear(name: str, force: Curve, rate: Curve | None, curves: _Curves) -> list[str]:
    """A material *MAT_S04, whose curves count extension and tension as positive."""
    over = curves.add(name, Curve(-force.x[::-1], -force.y[::-1]), LENGTH, 1.0)
    times = 0 if rate is None else curves.add(f"{name} over rate", Curve(-rate.x[::-1], rate.y[::-1]), LENGTH, 1.0)
    return ["*MAT_SPRING_NONLINEAR_ELASTIC", "       lcd       lcr", f"{over:10d}{times:10d}"]


def _spring(number: int, spring: Spring, words: str, material: list[str]) -> Iterator[str]:
    """An element with a part, section and material of its own."""
    keyword, names, values = material
    yield "*PART"
    yield f"{spring.name}: {words}"[:80]
    yield "$#     pid     secid       mid     eosid      hgid      grav    adpopt      tmid"
    yield f"{number:10d}{number:10d}{number:10d}" + f"{0:10d}" * 5
    yield "*SECTION_DISCRETE"
    yield "$#   secid       dro        kd        v0        cl        fd"
    yield f"{number:10d}{0:10d}" + f"{0.0:10.1f}" * 4
    yield "$#     cdl       tdl"
    yield f"{0.0:10.1f}{0.0:10.1f}"
    yield keyword
    yield f"$#     mid{names}"
    yield f"{number:10d}{values}"
    yield "*ELEMENT_DISCRETE"
    yield "$#   eid     pid      n1      n2     vid               s      pf          offset"
    yield f"{number:8d}{number:8d}{spring.left + 1:8d}{spring.right + 1:8d}{_AXIS:8d}{1.0:16.1f}{0:8d}{0.0:16.1f}"
