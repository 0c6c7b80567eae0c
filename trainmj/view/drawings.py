"""What vehicles and obstacles look like: a mesh for each material of the base scene, by the names that files state.

"livery" stands for the colour of the train. Every drawing takes where its body begins and ends, from the middle of the
vehicle [m], its cabs (1 for one in front, -1 for one at the rear), and half the length of what hangs below the floor
[m].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from trainmj.collision.envelope import Array
from trainmj.view.meshes import RADIUS, Mesh, bogie, box, joined, shadow, sheared, strut, wheel

_SECTION = np.array(  # half of a metro car's cross section, y and z [m], from the floor to the top of the roof
    [(1.25, 0.95), (1.38, 1.15), (1.40, 1.75), (1.40, 2.6), (1.36, 3.05), (1.22, 3.42), (0.95, 3.64), (0.5, 3.76)]
)
_SIDE = 1.412  # y of windows and doors, a finger's breadth outside the wall [m]
_DOOR_EVERY = 4.6  # approximate distance between doors [m]
_NOSE, _LONG_NOSE = 1.9, 3.6  # length of a cab, of a metro car and of a regional train [m]
_SECTION_OF_UNIT = 25.0  # a longer body is drawn as several on shared bogies [m]
_WINDSCREEN = ((-1.02, 2.0), (1.02, 2.0), (0.92, 3.05), (-0.92, 3.05))  # corners on the front of a cab, y and z [m]
_APRON = (  # the coloured front below the windscreen, bent where the cab begins to lean back
    ((-1.06, 1.36), (1.06, 1.36), (1.06, 1.75), (-1.06, 1.75)),
    ((-1.06, 1.75), (1.06, 1.75), (1.04, 1.94), (-1.04, 1.94)),
)
_LAMPS = (-0.82, 0.82)  # y of their middles [m]
_OUT = np.array([1.0, 1.01, 1.005])  # a gangway stands a little outside the walls
HUNG = 3.2
"""Half the length of what hangs below the floor of a long vehicle [m]."""


def _passenger(rear: float, front: float, cabs: Sequence[int], hung: float) -> dict[str, Mesh]:
    """A metro car."""
    nose = min(_NOSE, (front - rear) / 4)
    stations = _nose(rear, -1, nose)[::-1] if -1 in cabs else [_ring(rear)]
    stations += _nose(front, 1, nose) if 1 in cabs else [_ring(front)]
    inner = rear + (nose + 0.3 if -1 in cabs else 0.25), front - (nose + 0.3 if 1 in cabs else 0.25)
    doors, windows = _openings(*inner)
    pieces: dict[str, list[Mesh]] = {
        "shell": [_loft(stations)],
        "livery": [_both(*inner, (1.16, 1.62), -0.004), *(_both(a, b, (1.17, 3.12), 0.004) for a, b in doors)],
        "window": [_both(a, b, (1.98, 2.86)) for a, b in windows]
        + [_both(a + f * (b - a), a + (f + 0.34) * (b - a), (1.9, 2.9), 0.012) for a, b in doors for f in (0.1, 0.56)],
        "roof": [
            box((x - 1.5, x + 1.5), (-0.75, 0.75), (3.7, 3.98))
            for x in rear + (front - rear) * np.array([0.28, 0.72])
            if front - rear > 9
        ],
        "bogie": _underframe(rear, front, hung),
        "shade": [shadow(rear, front)],
        "lamp": [],
    }
    for direction in cabs:
        _add_face(pieces, front if direction > 0 else rear, direction, nose, "livery")
    return {name: joined(parts) for name, parts in pieces.items() if parts}


def _regional(rear: float, front: float, cabs: Sequence[int], hung: float) -> dict[str, Mesh]:
    """A car of a regional train: a long nose, a band of windows, two doors; a long body is an articulated unit."""
    nose = min(_LONG_NOSE, (front - rear) / 4)
    stations = _nose(rear, -1, nose)[::-1] if -1 in cabs else [_ring(rear)]
    stations += _nose(front, 1, nose) if 1 in cabs else [_ring(front)]
    inner = rear + (nose + 0.3 if -1 in cabs else 0.25), front - (nose + 0.3 if 1 in cabs else 0.25)
    edges = np.linspace(*inner, max(1, round((front - rear) / _SECTION_OF_UNIT)) + 1)
    joints = edges[1:-1]
    half = min(0.65, 0.08 * (inner[1] - inner[0]))
    doors = [a + share * (b - a) for a, b in pairwise(edges) for share in (0.25, 0.75)]
    panes = [(x - half + f * half, x - half + (f + 0.76) * half) for x in doors for f in (0.12, 1.12)]
    pieces: dict[str, list[Mesh]] = {
        "shell": [_loft(stations)],
        "livery": [
            *(_both(a, b, z, -0.004) for a, b in pairwise(edges) for z in ((1.16, 1.42), (2.98, 3.1))),
            *(_both(x - half, x + half, (1.17, 3.1), 0.006) for x in doors),
        ],
        "window": [
            *(_both(a + 0.3, b - 0.3, (1.98, 2.9)) for a, b in pairwise(edges)),
            *(_both(a, b, (1.75, 2.92), 0.014) for a, b in panes),
        ],
        "roof": [box((a + 2.2, b - 2.2), (-0.95, 0.95), (3.68, 3.92)) for a, b in pairwise(edges) if b - a > 9],
        "gangway": [_loft([_ring(x - 0.3) * _OUT, _ring(x + 0.3) * _OUT]) for x in joints],
        "bogie": _underframe(rear, front, hung),
        "shade": [shadow(rear, front)],
        "lamp": [],
    }
    for x in joints:
        shared = bogie(12.0)
        pieces["bogie"].append(Mesh(shared.vertices + np.array([x, 0.0, 0.0]), shared.faces))
    for direction in cabs:
        _add_face(pieces, front if direction > 0 else rear, direction, nose, "livery")
    return {name: joined(parts) for name, parts in pieces.items() if parts}


def _coach(rear: float, front: float, _: Sequence[int], hung: float) -> dict[str, Mesh]:
    """A coach behind a locomotive: flat ends, a row of small windows, doors at both ends."""
    inner = rear + 0.25, front - 0.25
    door = min(0.9, 0.12 * (front - rear))
    start, end = inner[0] + door + 0.6, inner[1] - door - 0.6
    n = max(1, int((end - start) / 1.9))
    middles = start + (end - start) * (np.arange(n) + 0.5) / n
    pane = min(0.6, 0.35 * (end - start) / n)
    ends = (inner[0] + 0.3, inner[0] + 0.3 + door), (inner[1] - 0.3 - door, inner[1] - 0.3)
    return {
        "shell": _loft([_ring(rear), _ring(front)]),
        "livery": joined([_both(*inner, (1.16, 1.95), -0.004), *(_both(*door, (1.17, 3.1), 0.006) for door in ends)]),
        "window": joined(
            [
                *(_both(x - pane, x + pane, (2.08, 2.85)) for x in middles),
                *(_both(a + 0.2 * (b - a), b - 0.2 * (b - a), (2.05, 2.85), 0.012) for a, b in ends),
            ]
        ),
        "gangway": joined([box((x - 0.02, x + 0.02), (-0.5, 0.5), (1.15, 3.1)) for x in (rear, front)]),
        "bogie": joined(_underframe(rear, front, hung)),
        "shade": shadow(rear, front),
    }


def _locomotive(rear: float, front: float, _: Sequence[int], hung: float) -> dict[str, Mesh]:
    """An electric locomotive with a cab at each end."""
    length, middle = front - rear, (rear + front) / 2
    nose = min(_NOSE, length / 4)
    grilles = np.linspace(rear + nose + 1.6, front - nose - 1.6, 6 if length > 10 else 0)
    arm = min(1.4, length / 8)
    pieces: dict[str, list[Mesh]] = {
        "livery": [_loft(_nose(rear, -1, nose)[::-1] + _nose(front, 1, nose))],
        "window": [_both(x - 0.35, x + 0.35, (2.1, 2.8)) for x in (rear + nose + 0.5, front - nose - 0.5)],
        "shell": [_both(rear + nose, front - nose, (1.16, 1.4), -0.004)],
        "roof": [
            box((rear + nose + 0.8, front - nose - 0.8), (-0.8, 0.8), (3.7, 3.9)),
            *(_both(x - 0.45, x + 0.45, (2.2, 2.8)) for x in grilles),
        ],
        "bogie": [
            *_underframe(rear, front, hung),
            *(strut((middle, middle + side * arm), (-0.5, -0.42), (3.9, 4.9), 0.08) for side in (-1, 1)),
            *(strut((middle, middle + side * arm), (0.42, 0.5), (3.9, 4.9), 0.08) for side in (-1, 1)),
            *(
                box((middle + side * arm - 0.2, middle + side * arm + 0.2), (-0.85, 0.85), (4.88, 4.95))
                for side in (-1, 1)
            ),
        ],
        "shade": [shadow(rear, front)],
        "lamp": [],
    }
    for end, direction in ((rear, -1), (front, 1)):
        _add_face(pieces, end, direction, nose, "shell")
    return {name: joined(parts) for name, parts in pieces.items()}


def _wagon(rear: float, front: float, _: Sequence[int], hung: float) -> dict[str, Mesh]:
    """A freight wagon with ribbed sides."""
    ribs = [
        box((x - 0.06, x + 0.06), (y - 0.05, y + 0.05), (1.25, 3.1))
        for x in np.linspace(rear + 0.1, front - 0.1, max(3, int((front - rear) / 1.4)))
        for y in (-1.42, 1.42)
    ]
    rims = [box((rear, front), (y - 0.07, y + 0.07), (3.05, 3.2)) for y in (-1.4, 1.4)]
    rims += [box((x - 0.07, x + 0.07), (-1.4, 1.4), (3.05, 3.2)) for x in (rear + 0.07, front - 0.07)]
    return {
        "livery": joined([box((rear, front), (-1.38, 1.38), (1.2, 3.08)), *ribs, *rims]),
        "bogie": joined([*_underframe(rear, front, hung), box((rear, front), (-1.1, 1.1), (0.95, 1.2))]),
        "shade": shadow(rear, front),
    }


def _lorry(rear: float, front: float, _cabs: Sequence[int], _hung: float) -> dict[str, Mesh]:
    """A lorry that stands along the track, its box to the rear and its cab in front."""
    length = front - rear
    cab = min(2.0, 0.35 * length)
    back = front - cab - min(0.25, 0.1 * length)  # of the box
    reach = min(RADIUS, length / 8)
    wheels = [
        wheel(x, y, reach) for x in (rear + 1.9 * reach, rear + 4.1 * reach, front - 0.5 * cab) for y in (-1.0, 1.0)
    ]
    return {
        "livery": box((rear, back), (-1.25, 1.25), (0.95, 3.6)),
        "shell": joined(
            [
                box((front - cab, front), (-1.2, 1.2), (0.75, 1.75)),
                sheared((front - cab, front - 0.3 * cab), (-1.2, 1.2), (1.75, 2.75), 0.3 * cab),
            ]
        ),
        "window": joined(
            [
                sheared((front - 0.3 * cab, front - 0.28 * cab), (-1.05, 1.05), (1.8, 2.6), 0.25 * cab),
                *(box((front - 0.75 * cab, front - 0.3 * cab), (y - 0.02, y + 0.02), (1.85, 2.5)) for y in (-1.2, 1.2)),
            ]
        ),
        "lamp": joined([box((front - 0.02, front + 0.03), (y - 0.17, y + 0.17), (0.95, 1.15)) for y in (-0.9, 0.9)]),
        "bogie": joined([*wheels, box((rear, front - 0.1), (-0.5, 0.5), (0.6, 0.95))]),
        "shade": shadow(rear, front),
    }


def _block(rear: float, front: float, _cabs: Sequence[int], _hung: float) -> dict[str, Mesh]:
    """A rigid obstacle that slides: a block on skids, with slanting stripes."""
    low, high, lean = 0.12, 1.65, 0.5
    width = (front - rear - lean) / (2 * max(1, round((front - rear) / 1.6)))
    starts = rear + width * np.arange(0, round((front - rear - lean) / width), 2)
    return {
        "livery": joined(
            [
                _leaning((x, x + width), (side * 1.2 - 0.015, side * 1.2 + 0.015), (low + 0.1, high - 0.1), lean)
                for x in starts
                for side in (-1, 1)
            ]
        ),
        "shell": box((rear, front), (-1.2, 1.2), (low, high)),
        "bogie": joined([box((rear + 0.1, front - 0.1), (y - 0.12, y + 0.12), (-0.02, low)) for y in (-0.75, 0.75)]),
        "shade": shadow(rear, front),
    }


def wall(face: float) -> dict[str, Mesh]:
    """A rigid wall that begins at a place along the track [m]: concrete, held from behind, with a striped edge."""
    heights = np.linspace(0.0, 5.0, 11)
    return {
        "wall": joined(
            [
                box((face, face + 1.2), (-3.0, 3.0), (-0.5, 5.0)),
                *(strut((face + 1.2, face + 4.2), (y - 0.25, y + 0.25), (4.2, 0.1), 0.6) for y in (-2.6, 0.0, 2.6)),
                box((face + 1.2, face + 4.6), (-3.0, 3.0), (-0.5, 0.15)),
            ]
        ),
        "partner": joined(_edge(face, heights, 0)),
        "window": joined(_edge(face, heights, 1)),
    }


def _edge(face: float, heights: Array, first: int) -> list[Mesh]:
    """Every second stripe along the upright edges of a wall."""
    rows = list(pairwise(heights))[first::2]
    return [
        box((face - 0.01, face + 0.35), (side * 3.0 - 0.02, side * 3.0 + 0.02), row) for row in rows for side in (-1, 1)
    ]


def _leaning(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], lean: float) -> Mesh:
    """A box whose top is farther forward by so much [m]."""
    block = box(x, y, z)
    block.vertices[block.vertices[:, 2] == z[1], 0] += lean
    return block


def _buffer_stop(rear: float, front: float, _cabs: Sequence[int], _hung: float) -> dict[str, Mesh]:
    """A buffer stop: a striped beam across the track, held by struts from behind."""
    back = min(front, rear + 3.2)
    beam = rear, rear + min(0.3, 0.3 * (back - rear))
    edges = np.linspace(-1.4, 1.4, 8)
    stripes = [box(beam, (a, b), (0.5, 1.35)) for a, b in pairwise(edges)]
    return {
        "livery": joined(stripes[::2]),
        "shell": joined(stripes[1::2]),
        "steel": joined(
            [
                *(box((rear, front), (y - 0.12, y + 0.12), (0.0, 0.22)) for y in (-0.75, 0.75)),
                *(box((beam[0] + 0.02, beam[1] - 0.02), (y - 0.12, y + 0.12), (0.2, 0.5)) for y in (-0.75, 0.75)),
                *(strut((beam[1], back), (y - 0.1, y + 0.1), (1.05, 0.1), 0.2) for y in (-0.75, 0.75)),
                box((back - 0.2, back), (-1.2, 1.2), (0.02, 0.25)),
            ]
        ),
        "shade": shadow(rear, back),
    }


def _add_face(pieces: dict[str, list[Mesh]], end: float, direction: int, length: float, apron: str) -> None:
    """Windscreen, apron of a material and lamps on the front of a cab."""
    panel = partial(_front_panel, end, direction, length)
    pieces["window"].append(panel(_WINDSCREEN))
    pieces[apron] += map(panel, _APRON)
    for y in _LAMPS:
        corners = [(y - 0.17, 1.5), (y + 0.17, 1.5), (y + 0.17, 1.64), (y - 0.17, 1.64)]
        pieces["lamp"].append(panel(corners, out=0.035))


def _ring(x: float) -> Array:
    """(2 n, 3) the cross section at x, from the right floor edge over the roof to the left one."""
    half = np.column_stack([np.full(len(_SECTION), x), _SECTION])
    return np.concatenate([half, half[::-1] * [1, -1, 1]])


def _nose(end: float, direction: int, length: float) -> list[Array]:
    """Cross sections of a cab towards its tip: narrower, and leaning back above the apron."""
    rings = []
    for part, narrow in ((1.0, 1.0), (0.45, 0.97), (0.12, 0.92), (0.0, 0.84)):
        ring = _ring(0.0)
        ring[:, 1] *= narrow
        ring[:, 2] -= 0.35 * (1 - part) ** 2 * np.clip((ring[:, 2] - 2.6) / 1.16, 0, 1)  # the roof comes down
        ring[:, 0] = end - direction * np.maximum(part * length, _rake(ring[:, 2], length) * (1 - 0.8 * part))
        rings.append(ring)
    return rings


def _rake(z: Array, length: float) -> Array:
    """How far the front of a cab leans back at a height [m]."""
    return np.asarray(np.interp(z, [0.95, 1.75, 3.76], [0.06, 0.0, 0.62 * length]))


def _loft(stations: list[Array]) -> Mesh:
    """A skin over cross sections along +x, closed at both ends."""
    n = len(stations[0])
    k = np.arange(n)
    m = (k + 1) % n
    faces = []
    for s in range(len(stations) - 1):
        a, b = s * n, (s + 1) * n
        faces += [np.stack([a + k, b + k, b + m], 1), np.stack([a + k, b + m, a + m], 1)]
    vertices = np.concatenate([*stations, stations[0], stations[-1]])  # ends have corners of their own: sharp edges
    low, other = np.arange(n // 2 - 1), n - 1 - np.arange(n // 2 - 1)  # strips across, each at two heights
    for base, flip in ((len(stations) * n, False), ((len(stations) + 1) * n, True)):
        quads = [(low, low + 1, other - 1), (low, other - 1, other)]
        faces += [base + np.stack([a, c, b] if flip else [a, b, c], 1) for a, b, c in quads]
    return Mesh(vertices, np.concatenate(faces)[:, ::-1].astype(np.int32))


def _openings(start: float, end: float) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Doors along a wall, and windows between them."""
    n = max(1, round((end - start) / _DOOR_EVERY))
    middles = start + (end - start) * (np.arange(n) + 0.5) / n
    half = min(0.68, 0.2 * (end - start) / n)
    doors = [(float(x) - half, float(x) + half) for x in middles]
    edges = [start, *(e for door in doors for e in door), end]
    windows = [(a + 0.3, b - 0.3) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1.0]
    return doors, windows


def _both(a: float, b: float, z: tuple[float, float], out: float = 0.0) -> Mesh:
    """The same panel on both walls."""
    return joined([box((a, b), (s * (_SIDE + out) - 0.02, s * (_SIDE + out) + 0.02), z) for s in (-1, 1)])


def _underframe(rear: float, front: float, hung: float) -> list[Mesh]:
    pieces = [box((rear + 0.1, front - 0.1), (-1.15, 1.15), (0.8, 0.97))]
    if front - rear > 12 and hung > 0.5:
        middle = (rear + front) / 2
        pieces.append(box((middle - hung, middle + hung), (-1.1, 1.1), (0.42, 0.82)))
    return pieces


def _front_panel(
    end: float, direction: int, length: float, corners: Sequence[tuple[float, float]], out: float = 0.02
) -> Mesh:
    """A flat panel on the front of a cab, its (y, z) corners anticlockwise from outside for +x."""
    points = [[end - direction * (float(_rake(np.array(z), length)) - out), y, z] for y, z in corners]
    back = [[x - direction * 0.05, y, z] for x, y, z in points]
    n = len(points)
    fan = [(0, i, i + 1) for i in range(1, n - 1)]
    rim = [t for i in range(n) for t in ((i, n + i, n + (i + 1) % n), (i, n + (i + 1) % n, (i + 1) % n))]
    faces = np.array(fan + rim, dtype=np.int32)
    return Mesh(np.array(points + back), faces if direction > 0 else faces[:, ::-1])


Drawing = Callable[[float, float, Sequence[int], float], dict[str, Mesh]]

_ON_BOGIES: Mapping[str, Drawing] = {
    "passenger": _passenger,
    "regional": _regional,
    "coach": _coach,
    "wagon": _wagon,
    "locomotive": _locomotive,
}
_OBSTACLES: Mapping[str, Drawing] = {"lorry": _lorry, "block": _block, "buffer_stop": _buffer_stop}
DRAWINGS: Mapping[str, Drawing] = {**_ON_BOGIES, **_OBSTACLES}
"""By the names that files state."""


def on_bogies(drawing: str) -> bool:
    """Whether a drawing has two bogies below it."""
    return drawing in _ON_BOGIES
