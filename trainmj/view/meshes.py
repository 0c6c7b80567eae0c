"""Meshes made from a few numbers: boxes and bars, running gear, track; and how one is cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trainmj.collision.envelope import Array

RADIUS, _TREAD, _CORNERS = 0.42, 0.13, 16  # of a wheel: radius and width [m], corners of its rim
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


def strut(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], thick: float) -> Mesh:
    """A bar from a height at one place along the track to another height at another place [m]."""
    (first, last), flip = sorted(zip(x, z, strict=True)), 0.5 * thick
    bar = box((first[0], last[0]), y, (-flip, flip))
    along = (bar.vertices[:, 0] - first[0]) / (last[0] - first[0])
    bar.vertices[:, 2] += first[1] + along * (last[1] - first[1])
    return bar


def sheared(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], lean: float) -> Mesh:
    """A box whose front, at the larger x, is farther forward at the bottom by so much [m]."""
    block = box(x, y, z)
    bottom = (block.vertices[:, 0] == x[1]) & (block.vertices[:, 2] == z[0])
    block.vertices[bottom, 0] += lean
    return block


def wheel(x: float, y: float, radius: float = RADIUS) -> Mesh:
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


def shadow(rear: float, front: float) -> Mesh:
    """The shadow at noon, which needs no shadow map."""
    return box((rear, front), (-1.5, 1.75), (-0.15, -0.145))


def sleepers(start: float, end: float) -> Mesh:
    """Sleepers from one place to another [m]."""
    places = np.arange(start, end, _SLEEPER_EVERY)
    return joined([box((x - 0.13, x + 0.13), (-1.25, 1.25), (-0.3, -0.155)) for x in places])


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
