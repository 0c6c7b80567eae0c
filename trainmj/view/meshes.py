"""Meshes of car bodies and track, made from a few numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trainmj.collision.envelope import Array

_SECTION = np.array(  # half of a metro car's cross section, y and z [m], from the floor to the top of the roof
    [(1.25, 0.95), (1.38, 1.15), (1.40, 1.75), (1.40, 2.6), (1.36, 3.05), (1.22, 3.42), (0.95, 3.64), (0.5, 3.76)]
)
_SIDE = 1.412  # y of windows and doors, a finger's breadth outside the wall [m]
_DOOR_EVERY = 4.6  # approximate distance between doors [m]
_NOSE = 1.9  # length of a cab [m]
_WINDSCREEN = ((-1.02, 2.0), (1.02, 2.0), (0.92, 3.05), (-0.92, 3.05))  # corners on the front of a cab, y and z [m]
_APRON = (  # the coloured front below the windscreen, bent where the cab begins to lean back
    ((-1.06, 1.36), (1.06, 1.36), (1.06, 1.75), (-1.06, 1.75)),
    ((-1.06, 1.75), (1.06, 1.75), (1.04, 1.94), (-1.04, 1.94)),
)
_LAMPS = (-0.82, 0.82)  # y of their middles [m]
_RADIUS, _TREAD, _CORNERS = 0.42, 0.13, 16  # of a wheel: radius and width [m], corners of its rim
ON_BOGIES = ("passenger", "locomotive", "wagon")
"""Drawings of vehicles with two bogies below them."""

HUNG = 3.2
"""Half the length of what hangs below the floor of a long vehicle [m]."""

_SLEEPER_EVERY = 0.6  # distance between sleepers [m]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles."""

    vertices: Array  # (n, 3) corners [m]
    faces: NDArray[np.int32]  # (m, 3) indices of the corners of each triangle, anticlockwise from outside


def joined(pieces: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(p.vertices) for p in pieces[:-1])])
    faces = np.concatenate([p.faces + s for p, s in zip(pieces, starts, strict=True)])
    return Mesh(np.concatenate([p.vertices for p in pieces]), faces.astype(np.int32))


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Mesh:
    """A box between two corners [m]."""
    corners = np.array([(a, b, c) for a in x for b in y for c in z])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Mesh(corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], dtype=np.int32))


def _strut(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], thick: float) -> Mesh:
    """A bar from a height at one place along the track to another height at another place [m]."""
    (first, last), flip = sorted(zip(x, z, strict=True)), 0.5 * thick
    bar = box((first[0], last[0]), y, (-flip, flip))
    along = (bar.vertices[:, 0] - first[0]) / (last[0] - first[0])
    bar.vertices[:, 2] += first[1] + along * (last[1] - first[1])
    return bar


def _sheared(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], lean: float) -> Mesh:
    """A box whose front, at the larger x, is farther forward at the bottom by so much [m]."""
    block = box(x, y, z)
    bottom = (block.vertices[:, 0] == x[1]) & (block.vertices[:, 2] == z[0])
    block.vertices[bottom, 0] += lean
    return block


def wheel(x: float, y: float, radius: float = _RADIUS) -> Mesh:
    """A wheel that stands on the rail."""
    n = _CORNERS
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.stack([x + radius * np.cos(angle), np.full(n, y), radius * (1 + np.sin(angle))], axis=1)
    vertices = np.concatenate([rim + np.array([0.0, side * _TREAD / 2, 0.0]) for side in (-1, 1)])
    k, m = np.arange(n), (np.arange(n) + 1) % n
    faces = [np.stack([m + n, m, k], 1), np.stack([k + n, m + n, k], 1)]
    fan = np.arange(1, n - 1)
    faces += [np.stack([0 * fan, fan + 1, fan], 1), np.stack([fan + n, fan + n + 1, 0 * fan + n], 1)]
    return Mesh(vertices, np.concatenate(faces).astype(np.int32))


def car(rear: float, front: float, cabs: Sequence[int], hung: float = HUNG) -> dict[str, Mesh]:
    """A metro car: a mesh for each material of the base scene; "livery" stands for that of the train.

    Args:
        rear: where the body begins, from the middle of the vehicle [m].
        front: where it ends [m].
        cabs: 1 for a cab in front, -1 for one at the rear.
        hung: half the length of what hangs below the floor, between the bogies [m].
    """
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
        "shade": [_shadow(rear, front)],
        "lamp": [],
    }
    for direction in cabs:
        _add_face(pieces, front if direction > 0 else rear, direction, nose, "livery")
    return {name: joined(parts) for name, parts in pieces.items() if parts}


def _add_face(pieces: dict[str, list[Mesh]], end: float, direction: int, length: float, apron: str) -> None:
    """Windscreen, apron of a material and lamps on the front of a cab."""
    panel = partial(_front_panel, end, direction, length)
    pieces["window"].append(panel(_WINDSCREEN))
    pieces[apron] += map(panel, _APRON)
    for y in _LAMPS:
        corners = [(y - 0.17, 1.5), (y + 0.17, 1.5), (y + 0.17, 1.64), (y - 0.17, 1.64)]
        pieces["lamp"].append(panel(corners, out=0.035))


def locomotive(rear: float, front: float, hung: float = HUNG) -> dict[str, Mesh]:
    """An electric locomotive with a cab at each end, by material."""
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
            *(_strut((middle, middle + side * arm), (-0.5, -0.42), (3.9, 4.9), 0.08) for side in (-1, 1)),
            *(_strut((middle, middle + side * arm), (0.42, 0.5), (3.9, 4.9), 0.08) for side in (-1, 1)),
            *(
                box((middle + side * arm - 0.2, middle + side * arm + 0.2), (-0.85, 0.85), (4.88, 4.95))
                for side in (-1, 1)
            ),
        ],
        "shade": [_shadow(rear, front)],
        "lamp": [],
    }
    for end, direction in ((rear, -1), (front, 1)):
        _add_face(pieces, end, direction, nose, "shell")
    return {name: joined(parts) for name, parts in pieces.items()}


def lorry(rear: float, front: float) -> dict[str, Mesh]:
    """A lorry that stands along the track, its box to the rear and its cab in front, by material."""
    length = front - rear
    cab = min(2.0, 0.35 * length)
    back = front - cab - min(0.25, 0.1 * length)  # of the box
    reach = min(_RADIUS, length / 8)
    wheels = [
        wheel(x, y, reach) for x in (rear + 1.9 * reach, rear + 4.1 * reach, front - 0.5 * cab) for y in (-1.0, 1.0)
    ]
    return {
        "livery": box((rear, back), (-1.25, 1.25), (0.95, 3.6)),
        "shell": joined(
            [
                box((front - cab, front), (-1.2, 1.2), (0.75, 1.75)),
                _sheared((front - cab, front - 0.3 * cab), (-1.2, 1.2), (1.75, 2.75), 0.3 * cab),
            ]
        ),
        "window": joined(
            [
                _sheared((front - 0.3 * cab, front - 0.28 * cab), (-1.05, 1.05), (1.8, 2.6), 0.25 * cab),
                *(box((front - 0.75 * cab, front - 0.3 * cab), (y - 0.02, y + 0.02), (1.85, 2.5)) for y in (-1.2, 1.2)),
            ]
        ),
        "lamp": joined([box((front - 0.02, front + 0.03), (y - 0.17, y + 0.17), (0.95, 1.15)) for y in (-0.9, 0.9)]),
        "bogie": joined([*wheels, box((rear, front - 0.1), (-0.5, 0.5), (0.6, 0.95))]),
        "shade": _shadow(rear, front),
    }


def buffer_stop(rear: float, front: float) -> dict[str, Mesh]:
    """A buffer stop: a striped beam across the track, held by struts from behind, by material."""
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
                *(_strut((beam[1], back), (y - 0.1, y + 0.1), (1.05, 0.1), 0.2) for y in (-0.75, 0.75)),
                box((back - 0.2, back), (-1.2, 1.2), (0.02, 0.25)),
            ]
        ),
        "shade": _shadow(rear, back),
    }


def cut(mesh: Mesh, x: float, direction: int) -> tuple[Mesh | None, Mesh | None]:
    """The parts of a mesh up to a plane across the track and beyond it, seen in a direction along the track.

    Faces share corners as before, so that smooth surfaces stay smooth.
    """
    found: list[Mesh | None] = []
    for way in (-direction, direction):
        ahead = way * (mesh.vertices[:, 0] - x) > 0.0
        inside = ahead[mesh.faces].all(axis=1)
        corners, faces = mesh.vertices.tolist(), mesh.faces[inside].tolist()
        crossings: dict[tuple[int, int], int] = {}
        for face in mesh.faces[ahead[mesh.faces].any(axis=1) & ~inside].tolist():
            points = []
            for a, b in zip(face, [*face[1:], face[0]], strict=True):
                if ahead[a]:
                    points.append(a)
                if ahead[a] != ahead[b]:
                    edge = min(a, b), max(a, b)
                    if edge not in crossings:
                        start, end = mesh.vertices[a], mesh.vertices[b]
                        crossings[edge] = len(corners)
                        corners.append(start + (x - start[0]) / (end[0] - start[0]) * (end - start))
                    points.append(crossings[edge])
            faces += [[points[0], points[k], points[k + 1]] for k in range(1, len(points) - 1)]
        used, own = np.unique(np.array(faces, dtype=np.int32), return_inverse=True)
        found.append(Mesh(np.array(corners)[used], own.reshape(-1, 3).astype(np.int32)) if faces else None)
    return found[0], found[1]


def wagon(rear: float, front: float, hung: float = HUNG) -> dict[str, Mesh]:
    """A freight wagon with ribbed sides, by material."""
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
        "shade": _shadow(rear, front),
    }


def _shadow(rear: float, front: float) -> Mesh:
    """The shadow at noon, which needs no shadow map."""
    return box((rear, front), (-1.5, 1.75), (-0.15, -0.145))


def sleepers(start: float, end: float) -> Mesh:
    """Sleepers from one place to another [m]."""
    places = np.arange(start, end, _SLEEPER_EVERY)
    return joined([box((x - 0.13, x + 0.13), (-1.25, 1.25), (-0.3, -0.155)) for x in places])


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


def bogie(length: float) -> Mesh:
    """A bogie of a body of a length [m], its middle at 0."""
    reach = min(1.25, length / 6)
    pieces = [box((-0.3, 0.3), (-0.95, 0.95), (0.4, 0.8))]
    for y in (-0.98, 0.98):
        pieces.append(box((-reach * 1.35, reach * 1.35), (y - 0.07, y + 0.07), (0.42, 0.66)))
        pieces += [wheel(d * reach, 0.77 * np.sign(y)) for d in (-0.9, 0.9)]
    return joined(pieces)


def frame(wheelbase: float, axle: float) -> Mesh:
    """The frame of a bogie without its wheelsets, its middle at 0, by its wheelbase and the height of its axles [m]."""
    reach = 0.5 * wheelbase + 0.4
    sides = [box((-reach, reach), (y - 0.07, y + 0.07), (axle, axle + 0.24)) for y in (-0.98, 0.98)]
    return joined([box((-0.3, 0.3), (-0.95, 0.95), (axle - 0.02, axle + 0.38)), *sides])


def wheelset(radius: float) -> Mesh:
    """Two wheels on an axle, which stands on the rails at 0."""
    axle = box((-0.08, 0.08), (-0.77, 0.77), (radius - 0.08, radius + 0.08))
    return joined([axle, *(wheel(0.0, y, radius) for y in (-0.77, 0.77))])


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
