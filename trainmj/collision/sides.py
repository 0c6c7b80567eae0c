"""Interfaces after a collision, as they are reported: strokes, stages, energies, and in the vertical plane faces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trainmj.collision.block import Tallies
from trainmj.collision.chain import Chain, n_own_sides, places_of_sides
from trainmj.collision.device import Path
from trainmj.collision.elementwise import added, in_rows, lesser, picked, positive
from trainmj.collision.envelope import Array, BoolArray
from trainmj.collision.lot import Lot
from trainmj.collision.used import Used
from trainmj.units import MM


@dataclass(frozen=True)
class StagePlace:
    """Where a stage is.

    Attributes:
        side: index of the side.
        path: index of its path through the device, among those of all sides.
        law: index of the law of that.
        name: of the stage.
        first: whether it is the first one on its path.
    """

    side: int
    path: int
    law: int
    name: str
    first: bool


class Sides:
    """Every interface of a lot; the front as one side's, or as both where these are not equal.

    They come from the front backwards, the moving train first. Values are (n_case, n_side) arrays, those of stages
    (n_case, n_stage).

    Attributes:
        places: of each, the index of its interface and the side (0 left, 1 right).
        interfaces: of the first case.
        names: of the interface, and of its side where both are reported.
        devices: names of the devices.
        stages: of all devices, in the order of the sides and of their acting.
        n_stages: (n_side,) how many stages each has.
        judged: whether the limits of the stages count: those of a partner that is no twin do not.
    """

    def __init__(self, lot: Lot, tally: Tallies, used: Used) -> None:
        """Look at the sides of a lot."""
        chain = lot.chain
        self._lot, self._tally, self._used = lot, tally, used
        self.places = places_of_sides(chain)
        self.interfaces = [chain.interfaces[k] for k, _ in self.places]
        sides = list(zip(self.interfaces, (side for _, side in self.places), strict=True))
        self.names = [interface.sides[side] for interface, side in sides]
        self.devices = [interface.devices[side].name for interface, side in sides]
        pushing, self._pulling = ([self._laws_of(k, side, sign) for k, side in self.places] for sign in (1.0, -1.0))
        self._laws = [[*push, *pull] for push, pull in zip(pushing, self._pulling, strict=True)]
        self.stages: list[StagePlace] = []
        self._path_laws: list[int] = []
        self._paths_of: list[list[int]] = []
        for n, (paths, laws) in enumerate(zip(_paths(chain), pushing, strict=True)):
            self._paths_of.append([])
            for path, law in zip(paths, laws, strict=True):
                place = len(self._path_laws)
                self.stages += [StagePlace(n, place, law, s.name, k == 0) for k, s in enumerate(path.stages)]
                self._path_laws.append(law)
                self._paths_of[n].append(place)
        own = n_own_sides(chain)
        self.judged = [chain.twin or n < own for n in range(len(self.places))]
        self._stages_of: list[list[int]] = [[] for _ in self.places]
        for k, stage in enumerate(self.stages):
            self._stages_of[stage.side].append(k)
        self.n_stages = [len(stages) for stages in self._stages_of]

    def _laws_of(self, k: int, side: int, sign: float) -> list[int]:
        """The laws of a side of an interface that push or pull; none of draw gear that is the other side's."""
        interface = self._lot.chain.interfaces[k]
        found = []
        for e, element in enumerate(interface.elements):
            own = element.law_of(side, interface.two_sided)
            if own is not None and element.sign == sign:
                found.append(self._used.places[k, e, own])
        return found

    def tallied(self, name: str) -> Array:
        """A value of the tally at the interface."""
        return picked(getattr(self._tally, name), [k for k, _ in self.places])

    @cached_property
    def _numbers(self) -> tuple[Array, Array]:
        """(n_case, n_path) strokes at which paths begin, (3, n_case, n_stage) starts, ends and limits of stages [m]."""

        def of(chain: Chain) -> list[float]:
            paths = [path for of_side in _paths(chain) for path in of_side]
            stages = [number for path in paths for s in path.stages for number in (s.start, s.end, s.limit)]
            return [*(path.start for path in paths), *stages]

        values, n = self._lot.values(of), len(self._path_laws)
        return values[:, :n], np.moveaxis(values[:, n:].reshape(len(values), -1, 3), -1, 0)

    @property
    def _pressed(self) -> Array:
        """(n_case, n_path) largest strokes of the laws of the paths [m]."""
        return picked(self._used.stroke, self._path_laws)

    @cached_property
    def stroke(self) -> Array:
        """Largest stroke of its device [m]; behind a shear-off, that by which the next path is pressed."""
        starts, pressed = self._numbers[0], self._pressed
        found = np.zeros((len(starts), len(self.places)))
        reached = np.ones_like(found, dtype=bool)
        for n in range(max(map(len, self._paths_of))):
            sides = [k for k, paths in enumerate(self._paths_of) if len(paths) > n]
            own = [self._paths_of[k][n] for k in sides]
            start, used, before = picked(starts, own), picked(pressed, own), picked(found, sides)
            first = start == 0.0
            now = np.where(first, used, np.where(used > 0.0, start + used, lesser(before, start)))
            found[:, sides] = np.where(reached[:, sides], now, before)
            reached[:, sides] &= first | (used > 0.0)
        return found

    @cached_property
    def stage_stroke(self) -> Array:
        """(n_case, n_stage) largest strokes of the stages themselves [m]."""
        starts, (start, end, _) = self._numbers
        paths = [stage.path for stage in self.stages]
        return positive(lesser(picked(starts, paths) + picked(self._pressed, paths), end) - start)

    @property
    def stage_limit(self) -> Array:
        """(n_case, n_stage) what the design allows of them [m]; infinite where it states nothing."""
        return np.asarray(self._numbers[1][2])

    @cached_property
    def stage_energy(self) -> Array:
        """(n_case, n_stage) energy that the stages have absorbed [J].

        Those behind the first one of a law have what the curve of first loading at rest says, and the first one what
        is left; speed may add to it.
        """
        behind = [k for k, stage in enumerate(self.stages) if not stage.first]
        paths, laws = ([getattr(self.stages[k], name) for k in behind] for name in ("path", "law"))
        start = picked(self._numbers[1][0], behind) - picked(self._numbers[0], paths)
        end = start + picked(self.stage_stroke, behind)
        of_end, of_start = np.split(self._used.absorbed(laws + laws, np.append(end, start, axis=1)), 2, axis=1)
        energy = np.empty_like(self.stage_stroke)
        energy[:, behind] = others = positive(of_end - of_start)
        first = [k for k, stage in enumerate(self.stages) if stage.first]
        rows = [[n for n, path in enumerate(paths) if path == self.stages[k].path] for k in first]
        lost = picked(self._used.lost, [self.stages[k].law for k in first])
        energy[:, first] = positive(lost - added(in_rows(others, rows, 0.0)))
        return energy

    @cached_property
    def end_time(self) -> Array:
        """When its curve ended, if nothing is stated behind it [s]; infinite if it did not."""
        times = in_rows(self._used.left("end_time"), self._laws, -1.0)
        return np.asarray(np.where(times >= 0.0, times, np.inf).min(axis=-1))

    @property
    def drawn_out(self) -> BoolArray:
        """Whether that of its draw gear did."""
        times = in_rows(self._used.left("end_time"), self._pulling, -1.0)
        return np.asarray((times >= 0.0).any(axis=-1))

    @property
    def permanent(self) -> Array:
        """Permanent set [m]."""
        starts, pressed, kept = self._numbers[0], self._pressed, picked(self._used.permanent, self._path_laws)
        found = np.zeros((len(starts), len(self.places)))
        for n in range(max(map(len, self._paths_of))):
            sides = [k for k, paths in enumerate(self._paths_of) if len(paths) > n]
            start, used, left = (picked(v, [self._paths_of[k][n] for k in sides]) for v in (starts, pressed, kept))
            found[:, sides] = np.where((start == 0.0) | (used > 0.0), start + left, picked(found, sides))
        return found

    @cached_property
    def energy(self) -> Array:
        """Absorbed energy [J]."""
        return added(in_rows(self._used.lost, self._laws, 0.0))

    @property
    def energy_by_curve(self) -> Array:
        """What it would have absorbed by its curves alone [J]."""
        return added(in_rows(self._used.lost - self._used.beside_curve, self._laws, 0.0))

    @cached_property
    def beside_curves(self) -> tuple[Array, Array]:
        """(n_case,) largest difference of a device to the area below its curve [J], and the index of its side.

        A dashpot may add to the area, and counts where less was absorbed only.
        """
        laws = [law for laws in self._laws for law in laws]
        more = picked(self._used.beside_curve, laws)
        error = np.where(self._used.damped[:, laws], positive(-more), np.abs(more))
        worst = error.argmax(axis=-1)  # what is not a number counts as the largest
        sides = np.array([n for n, laws in enumerate(self._laws) for _ in laws])
        return error.max(axis=-1), sides[worst]

    @cached_property
    def crush_mm(self) -> Array:
        """Stroke without empty strokes [mm]: what counts in TS."""
        return added(in_rows(self.stage_stroke / MM, self._stages_of, 0.0))

    @property
    def own_crush_mm(self) -> Array:
        """(n_case,) that of all sides of the moving train [mm]."""
        return added(self.crush_mm[:, : n_own_sides(self._lot.chain)])

    def of_ends(self, name: str) -> Array:
        """A value of the tally at the interface, in the vertical plane."""
        return self.tallied(f"ends_{name}")

    def of_lines(self, name: str) -> Array:
        """The largest value of the tally at its lines."""
        values = getattr(self._tally, f"line_{name}")
        return np.stack([values[:, self._lot.chain.lines_of(k)].max(axis=-1) for k, _ in self.places], axis=-1)

    @property
    def met(self) -> Array:
        """(n_case, n_line) step of the faces of lines when they first carried force [m]; nan if they never did."""
        return np.where(self._tally.line_met_time >= 0.0, np.abs(self._tally.line_met), np.nan)

    @property
    def met_step(self) -> Array:
        """That of the last path [m]; nan if it has none."""
        chain = self._lot.chain
        last = [chain.lines_of(k).start + len(n) - 1 for (k, _), n in zip(self.places, self._paths_of, strict=True)]
        return np.where([chain.lines[line].strut for line in last], np.nan, picked(self.met, last))

    @property
    def faced(self) -> list[bool]:
        """(n_side,) whether there are faces."""
        lines = self._lot.chain.lines
        return [any(not lines[place].strut for _, place in self.on_lines(n)) for n in range(len(self.places))]

    def on_lines(self, side: int) -> Iterator[tuple[str, int]]:
        """The stage that comes first on each path of a side, with the place of its line; none along the track."""
        chain = self._lot.chain
        if chain.lines:
            first = [stage.name for stage in self.stages if stage.side == side and stage.first]
            yield from zip(first, range(chain.lines_of(self.places[side][0]).start, len(chain.lines)), strict=False)

    @property
    def off_time(self) -> Array:
        """(n_case, n_line) when one face slid off the other, or pins met [s]; nan if none did."""
        return np.where(self._tally.line_off_time >= 0.0, self._tally.line_off_time, np.nan)

    @cached_property
    def overlap(self) -> Array:
        """(n_case, n_line) step at which the faces of lines slide off each other [m]."""
        return self._lot.values(lambda chain: [line.overlap for line in chain.lines])


def _paths(chain: Chain) -> list[tuple[Path, ...]]:
    """The paths through the device of each side."""
    return [chain.interfaces[k].paths(side) for k, side in places_of_sides(chain)]
