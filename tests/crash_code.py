"""An explicit program for nodes and springs: reads decks of LS-DYNA and Radioss and integrates them as these do.

It knows the formats of these programs and nothing of trainmj. Keyword files: cards of fixed columns as in the LS-DYNA
keyword manual, with curves divided evenly into LCINT intervals as it warns. Starter files: cards as in the Radioss
starter manual, springs as its engine moves them by hardening flag H.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numba import njit
from numba.extending import register_jitable

LINEAR, DAMPER, S03, S04, S08, H0, H1, H2, H7 = range(9)
N_NUMBERS = 5
EVEN = 900  # points of a curve that was divided evenly, at least


@dataclass
class Model:
    """What a deck says, in its own units.

    Nodes by number; springs as (kind, first node, second node, five numbers); functions by number.
    """

    x: dict[int, float] = field(default_factory=dict)
    mass: dict[int, float] = field(default_factory=dict)
    speed: dict[int, float] = field(default_factory=dict)
    held: dict[int, str] = field(default_factory=dict)  # "011111": what is held of x, y, z and turns about them
    names: dict[int, str] = field(default_factory=dict)
    springs: list[tuple[int, int, int, list[float]]] = field(default_factory=list)
    titles: list[str] = field(default_factory=list)
    curves: dict[int, np.ndarray] = field(default_factory=dict)  # (n, 2) as written
    divided: dict[int, np.ndarray] = field(default_factory=dict)  # and as the program uses them
    loads: list[tuple[int, int]] = field(default_factory=list)  # node, curve
    raised: list[str] = field(default_factory=list)  # springs whose stiffness is less than a slope of their curve
    step: float = 0.0
    end: float = 0.0

    def of_vehicles(self) -> list[int]:
        """Nodes in front of the wall and the ground, which are vehicles or parts of them."""
        fixed = min(n for n, ties in self.held.items() if ties == "111111")
        return [n for n in sorted(self.x) if n < fixed]


def _cards(text: str) -> dict[str, list[list[str]]]:
    """The blocks of a keyword file: by keyword, each its lines without comments."""
    found: dict[str, list[list[str]]] = {}
    block: list[str] = []
    for line in text.splitlines():
        if line.startswith("*"):
            block = []
            found.setdefault(line.strip(), []).append(block)
        elif not line.startswith("$"):
            block.append(line)
    return found


def _columns(line: str, *widths: int) -> list[str]:
    """The fields of a line; nothing may stand behind the last one."""
    found, at = [], 0
    for width in widths:
        found.append(line[at : at + width].strip())
        at += width
    assert not line[at:].strip(), f"columns behind {at}: {line!r}"
    return found


def _real(text: str) -> float:
    """A real number as Fortran reads it: with a point, or it would be scaled or taken for an integer."""
    assert "." in text, text
    return float(text)


def read_keyword(text: str) -> Model:
    """A keyword file of LS-DYNA."""
    model, cards = Model(), _cards(text)
    assert next(iter(cards)) == "*KEYWORD"
    assert list(cards)[-1] == "*END"
    (node_cards,) = cards["*NODE"]
    for line in node_cards:
        number, x, y, z, tc, rc = _columns(line, 8, 16, 16, 16, 8, 8)
        assert (_real(y), _real(z), int(tc), int(rc)) == (0.0, 0.0, 0, 0)
        model.x[int(number)] = _real(x)
    for line in cards["*BOUNDARY_SPC_NODE"][0]:
        number, system, *ties = _columns(line, *[10] * 8)
        assert int(system) == 0
        model.held[int(number)] = "".join(ties)
    for line in cards["*ELEMENT_MASS"][0]:
        _, node, mass, _ = _columns(line, 8, 8, 16, 8)
        model.mass[int(node)] = _real(mass)
    for line in cards.get("*INITIAL_VELOCITY_NODE", [[]])[0]:
        node, vx, *others = _columns(line, *[10] * 8)
        assert all(float(other) == 0.0 for other in others)
        model.speed[int(node)] = _real(vx)
    (orientation,) = cards["*DEFINE_SD_ORIENTATION"]
    axis, iop, *vector = _columns(orientation[0], *[10] * 7)
    assert (int(iop), [float(v) for v in vector]) == (0, [1.0, 0.0, 0.0, 0.0, 0.0])
    steps = {}
    for title, head, *points in cards["*DEFINE_CURVE_TITLE"]:
        number, sidr, sfa, sfo, offa, offo, dattyp, lcint = _columns(head, *[10] * 8)
        assert (int(sidr), _real(sfa), _real(sfo), _real(offa), _real(offo), int(dattyp)) == (0, 1, 1, 0, 0, 0), title
        model.curves[int(number)] = np.array([[_real(v) for v in _columns(p, 20, 20)] for p in points])
        steps[int(number)] = int(lcint)
        assert (np.diff(model.curves[int(number)][:, 0]) > 0).all(), title
    for number, curve in model.curves.items():
        x = np.linspace(curve[0, 0], curve[-1, 0], steps[number] + 1)
        model.divided[number] = np.column_stack([x, np.interp(x, curve[:, 0], curve[:, 1])])
    materials = {}
    layouts = {
        "*MAT_SPRING_ELASTIC": (LINEAR, 2),
        "*MAT_DAMPER_VISCOUS": (DAMPER, 2),
        "*MAT_SPRING_ELASTOPLASTIC": (S03, 4),
        "*MAT_SPRING_NONLINEAR_ELASTIC": (S04, 3),
        "*MAT_SPRING_INELASTIC": (S08, 4),
    }
    for keyword, (kind, n) in layouts.items():
        for block in cards.get(keyword, []):
            (line,) = block
            number, *values = _columns(line, *[10] * n)
            curves = {S04: 2, S08: 1}.get(kind, 0)
            materials[int(number)] = (
                kind,
                [float(int(v)) for v in values[:curves]] + [_real(v) for v in values[curves:]],
            )
    parts, sections = {}, {}
    for title, line in cards["*PART"]:
        part, section, material, *_ = (int(v) for v in _columns(line, *[10] * 8))
        parts[part] = title, section, material
    for block in cards["*SECTION_DISCRETE"]:
        first, second = block
        section, torsion, *values = _columns(first, *[10] * 6)
        assert int(torsion) == 0
        assert not any(_real(v) for v in values)
        assert not any(_real(v) for v in _columns(second, 10, 10))
        sections[int(section)] = True
    for block in cards["*ELEMENT_DISCRETE"]:
        for line in block:
            _, part, n1, n2, vid, scale, pf, offset = _columns(line, 8, 8, 8, 8, 8, 16, 8, 16)
            assert (vid, _real(scale), int(pf), _real(offset)) == (axis, 1.0, 0, 0.0)
            title, section, material = parts[int(part)]
            assert sections[section]
            kind, values = materials[material]
            if kind == S08:
                curve = model.curves[int(values[0])]
                assert curve[0].tolist() == [0.0, 0.0], "in the first quadrant, from the origin"
                values = [values[0], _stiffness(model, title, values[1], curve), values[2]]
            model.springs.append((kind, int(n1), int(n2), [*values, *[0.0] * (N_NUMBERS - len(values))]))
            model.titles.append(title)
    for block in cards.get("*LOAD_NODE_POINT", []):
        for line in block:
            node, dof, curve, factor, *others = _columns(line, *[10] * 8)
            assert (int(dof), _real(factor), [int(v) for v in others]) == (1, 1.0, [0, 0, 0, 0])
            model.loads.append((int(node), int(curve)))
            model.divided[int(curve)] = model.curves[int(curve)]  # loads are not divided
    model.end = _real(_columns(cards["*CONTROL_TERMINATION"][0][0], *[10] * 6)[0])
    _, _, _, _, _, most, *_ = _columns(cards["*CONTROL_TIMESTEP"][0][0], *[10] * 8)
    model.step = float(model.curves[int(most)][:, 1].min())
    for name in ("DEFORC", "NODOUT", "GLSTAT"):
        assert _real(_columns(cards[f"*DATABASE_{name}"][0][0], *[10] * 4)[0]) > 0.0
    return model


def _stiffness(model: Model, title: str, stated: float, curve: np.ndarray) -> float:
    """The unloading stiffness, which is at least the steepest slope of the curve."""
    steepest = float(np.max(np.diff(curve[:, 1]) / np.diff(curve[:, 0])))
    if steepest > stated * (1 + 1e-6):
        model.raised.append(title)
    return max(stated, steepest)


def _blocks(text: str) -> list[tuple[list[str], list[str]]]:
    """The blocks of a starter or engine file: the words of its option, and its lines without comments."""
    found: list[tuple[list[str], list[str]]] = []
    for line in text.splitlines():
        if line.startswith("/"):
            found.append((line.strip("/").split("/"), []))
        elif not line.startswith("#") and found:
            found[-1][1].append(line)
    return found


def read_starter(text: str, engine: str) -> Model:
    """A starter file of Radioss with its engine file."""
    assert text.startswith("#RADIOSS STARTER\n")
    model, blocks = Model(), _blocks(text)
    assert blocks[0][0] == ["BEGIN"]
    assert blocks[-1][0] == ["END"]
    run, version, *units = blocks[0][1]
    assert int(version[:10]) >= 2017
    assert [_columns(line, 20, 20, 20) for line in units] == 2 * [["Mg", "mm", "s"]]
    groups, properties, parts, bcs, springs = {}, {}, {}, [], []
    speeds, masses, loads = [], [], []
    for (option, *words), lines in blocks:
        if option == "NODE":
            for line in lines:
                number, x, y, z = _columns(line, 10, 20, 20, 20)
                assert (_real(y), _real(z)) == (0.0, 0.0)
                model.x[int(number)] = _real(x)
        elif option == "GRNOD":
            assert words[0] == "NODE"
            groups[int(words[1])] = [int(v) for line in lines[1:] for v in line.split()]
        elif option == "BCS":
            blank, moves, _, turns, system, group = _columns(lines[1], 3, 3, 1, 3, 10, 10)
            assert (blank, int(system)) == ("", 0)
            bcs.append((int(group), moves + turns))
        elif option == "ADMAS":
            assert words[0] == "0"
            mass, group = _columns(lines[1], 20, 10)
            masses.append((int(group), _real(mass)))
        elif option == "INIVEL":
            assert words[0] == "TRA"
            vx, vy, vz, group, _ = _columns(lines[1], 20, 20, 20, 10, 10)
            assert (_real(vy), _real(vz)) == (0.0, 0.0)
            speeds.append((int(group), _real(vx)))
        elif option == "FUNCT":
            points = np.array([[_real(v) for v in _columns(p, 20, 20)] for p in lines[1:]])
            assert (np.diff(points[:, 0]) > 0).all(), lines[0]
            model.curves[int(words[0])] = model.divided[int(words[0])] = points
        elif option == "PROP":
            assert words[0] == "TYPE4"
            _, first, second, third, fourth = lines
            mass, _, sensor, active, per_length = _columns(first, 20, 30, 10, 10, 10)
            assert (int(sensor), int(active), int(per_length)) == (0, 0, 0)
            k, c, a, b, d = (_real(v) for v in _columns(second, *[20] * 5))
            force, h, rate, unloading, more, _, low, high = _columns(third, *[10] * 6, 20, 20)
            f1, e, scale, more_scale = (_real(v) for v in _columns(fourth, *[20] * 4))
            assert (a, b, d, f1, scale, more_scale, int(more), _real(low), _real(high)) == (0,) * 9
            properties[int(words[1])] = _real(mass), k, c, int(force), int(h), int(rate), int(unloading), e
        elif option == "PART":
            title, line = lines
            parts[int(words[0])] = title, int(_columns(line, 10, 10, 10)[0])
        elif option == "SPRING":
            for line in lines:
                springs.append((int(words[0]), *(int(v) for v in _columns(line, 10, 10, 10))))
        elif option == "CLOAD":
            curve, axis, system, sensor, group, blank, x, y = _columns(lines[1], *[10] * 6, 20, 20)
            assert (axis, int(system), int(sensor), blank, _real(x), _real(y)) == ("X", 0, 0, "", 1.0, 1.0)
            loads.append((int(group), int(curve)))
        else:
            assert option in ("BEGIN", "TITLE", "TH", "END"), option
    for group, ties in bcs:
        model.held |= dict.fromkeys(groups[group], ties)
    for group, mass in masses:
        model.mass |= dict.fromkeys(groups[group], mass)
    for group, speed in speeds:
        model.speed |= dict.fromkeys(groups[group], speed)
    model.loads = [(node, curve) for group, curve in loads for node in groups[group]]
    for part, _, n1, n2 in springs:
        title, prop = parts[part]
        mass, k, c, force, h, rate, unloading, e = properties[prop]
        assert mass > 1e-15
        for node in (n1, n2):
            if node in model.mass:
                model.mass[node] += 0.5 * mass
        kind = {0: H0, 1: H1, 2: H2, 7: H7}[h]
        if h in (1, 2):
            k = _stiffness(model, title, k, model.curves[force])
        second = float(unloading) if h == 7 else float(rate)
        assert e == (1.0 if rate else 0.0)
        model.springs.append((kind, n1, n2, [k, c, float(force), second, 0.0]))
        model.titles.append(title)
    options = {"/".join(words): lines for words, lines in _blocks(engine)}
    model.end = _real(options[f"RUN/{run}/1"][0].strip())
    model.step = _real(_columns(options["DTIX"][0], 20, 20)[1])
    assert "DT/NODA" in options, "by nodes: by elements the step would be that of the masses of springs"
    return model


@register_jitable
def _at(curves, first, last, place, x):
    """A curve at x, whose end parts go on; searched for from the last place on, or where it is if evenly divided."""
    k = place
    if last - first > EVEN:
        k = first + int((x - curves[first][0]) / (curves[last - 1][0] - curves[first][0]) * (last - 1 - first))
        k = min(max(k, first), last - 2)
    while k > first and x < curves[k][0]:
        k -= 1
    while k < last - 2 and x >= curves[k + 1][0]:
        k += 1
    slope = (curves[k + 1][1] - curves[k][1]) / (curves[k + 1][0] - curves[k][0])
    return curves[k][1] + slope * (x - curves[k][0]), k


def _integrate(
    mass,
    v,
    kind,
    ends,
    numbers,
    curves,
    begin,
    places,
    loads,
    step,
    n_steps,
    pairs,
    moved,
    force,
    state,
    before,
    carried,
    most,
    place_of_load,
):
    """Step by step; arrays, or lists of lists where it is not compiled, which then are quicker."""
    n, m = len(mass), len(kind)
    for step_number in range(n_steps):
        for i in range(n):
            force[i] = 0.0
        for e in range(m):
            i, j = ends[e]
            d, rate = moved[j] - moved[i], v[j] - v[i]  # extension; the rate is that of half a step ago
            a, b, c, f = numbers[e][0], numbers[e][1], numbers[e][2], 0.0
            kind_e = kind[e]
            if kind_e == LINEAR:
                f = a * d
            elif kind_e == DAMPER:
                f = a * rate
            elif kind_e == S03:  # K, KT, FY
                trial = a * (d - state[e][0])
                limit = c + (a * b / (a - b) if b > 0.0 else 0.0) * state[e][1]
                if abs(trial) > limit:
                    slip = (abs(trial) - limit) / (a + (a * b / (a - b) if b > 0.0 else 0.0))
                    state[e][0] += slip if trial > 0 else -slip
                    state[e][1] += slip
                    trial = a * (d - state[e][0])
                f = trial
            elif kind_e == S04:  # curve, curve over rate
                p = int(a)
                f, places[e][0] = _at(curves, begin[p], begin[p + 1], places[e][0], d)
                if b > 0.0:
                    p = int(b)
                    g, places[e][1] = _at(curves, begin[p], begin[p + 1], places[e][1], rate)
                    f *= g
            elif kind_e == S08:  # curve, KU, CTF
                p, u = int(a), -c * d
                if u > state[e][0]:
                    envelope, places[e][0] = _at(curves, begin[p], begin[p + 1], places[e][0], u)
                    f = b * (u - state[e][0])
                    if f >= envelope:
                        f = envelope
                        state[e][0] = u - f / b
                f *= -c
            else:  # K, C, force, rate or unloading
                dx = d - before[e]
                p = int(c)
                if p > 0:
                    y, places[e][0] = _at(curves, begin[p], begin[p + 1], places[e][0], d)
                if kind_e == H0:
                    f = a * d if p == 0 else y
                elif kind_e == H1:
                    f = carried[e] + a * dx
                    x = (state[e][0] if f >= 0.0 else -state[e][0]) + f / a
                    y, places[e][0] = _at(curves, begin[p], begin[p + 1], places[e][0], x)
                    if (f >= 0.0 and f > y) or (f < 0.0 and f < y):
                        state[e][0] += abs(f - y) / a
                        f = y
                elif kind_e == H2:
                    if d > state[e][0]:
                        f = min(a * (d - state[e][0]), y)
                        state[e][0] = d - f / a
                    elif d < state[e][1]:
                        f = max(a * (d - state[e][1]), y)
                        state[e][1] = d - f / a
                elif kind_e == H7:
                    q = int(numbers[e][3])
                    y2, places[e][1] = _at(curves, begin[q], begin[q + 1], places[e][1], d)
                    f = carried[e] + a * dx
                    upper, lower = (y, y2) if d >= 0.0 else (y2, y)
                    f = min(f, upper) if dx >= 0.0 else max(f, lower)
                carried[e], before[e] = f, d
                if kind_e == H0 and numbers[e][3] > 0.0:
                    q = int(numbers[e][3])
                    g, places[e][1] = _at(curves, begin[q], begin[q + 1], places[e][1], rate)
                    f *= 1.0 + g
                f += b * rate
            force[i] += f
            force[j] -= f
        time = step_number * step
        for k in range(len(loads)):
            p = loads[k][1]
            f, place_of_load[k] = _at(curves, begin[p], begin[p + 1], place_of_load[k], time)
            force[loads[k][0]] += f
        for i in range(n):
            if mass[i] > 0.0:
                v[i] += force[i] / mass[i] * (step if step_number else 0.5 * step)
                moved[i] += v[i] * step
        for k in range(len(pairs)):
            most[k] = max(most[k], moved[pairs[k][0]] - moved[pairs[k][1]])


@cache
def _compiled() -> Callable[..., None]:
    return njit(_integrate, cache=True)


def run(
    model: Model, pairs: list[tuple[int, int]], until: float | None = None, step: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Largest closures of pairs of nodes, and last speeds of all nodes, in the units of the deck.

    By central differences with the step of the deck, to its end or another one. With a step of one's own, which must
    be a few hundredths of the period of what swings, it is done in Python, without seconds of compilation.
    """
    numbers = sorted(model.x)
    place = {number: k for k, number in enumerate(numbers)}
    mass = np.array([0.0 if model.held[n] == "111111" else model.mass[n] for n in numbers])
    speed = np.array([model.speed.get(n, 0.0) for n in numbers])
    begin = np.zeros(max(model.divided, default=0) + 2, dtype=np.int64)
    rows, at = [np.zeros((0, 2))], 0
    for number in range(1, len(begin) - 1):
        begin[number] = at
        if number in model.divided:
            rows.append(model.divided[number])
            at += len(rows[-1])
    begin[-1] = at
    kind = np.array([s[0] for s in model.springs])
    ends = np.array([[place[s[1]], place[s[2]]] for s in model.springs])
    values = np.array([s[3] for s in model.springs])
    places = np.zeros((len(kind), 2), dtype=np.int64)
    of_curves = {S04: (0, 1), S08: (0, 0), H0: (2, 3), H1: (2, 2), H2: (2, 2), H7: (2, 3)}
    for e, k in enumerate(kind):
        for side, column in enumerate(of_curves.get(k, ())):
            places[e, side] = begin[int(values[e, column])]
    loads = np.array([[place[n], c] for n, c in model.loads], dtype=np.int64).reshape(-1, 2)
    asked = np.array([[place[a], place[b]] for a, b in pairs], dtype=np.int64).reshape(-1, 2)
    own = step or model.step
    steps = round((until or model.end) / own)
    n, m = len(mass), len(kind)
    found = [mass, speed, kind, ends, values, np.concatenate(rows), begin, places, loads, own, steps, asked]
    found += [np.zeros(n), np.zeros(n), np.zeros((m, 2)), np.zeros(m), np.zeros(m), np.zeros(len(asked))]
    found.append(begin[loads[:, 1]])
    if step:
        found = [part.tolist() if isinstance(part, np.ndarray) else part for part in found]
        _integrate(*found)
    else:
        _compiled()(*found)
    return np.array(found[17]), np.array(found[1])
