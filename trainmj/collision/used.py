"""The laws of devices after a collision: what they have taken, hold, and keep of their stroke."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np

from trainmj.collision.block import Tallies
from trainmj.collision.chain import Chain, Element
from trainmj.collision.elementwise import added, picked, positive
from trainmj.collision.envelope import Array, BoolArray, Envelope, IntArray, work_along
from trainmj.collision.kind import Kind, Law
from trainmj.collision.lot import Lot


class Used:
    """Every law of the cases of a lot, in the order of the records, with what is left of it.

    All values are (n_case, n_law) arrays, of one device unless something else is said.

    Attributes:
        laws: those of the first case.
        places: the place of each of them by the indices of its interface, its element there and itself in that.
    """

    def __init__(self, lot: Lot, tally: Tallies) -> None:
        """Look at the laws of a lot."""
        self._lot, self._tally = lot, tally
        records = [
            ((k, e, n), record)
            for k, interface in enumerate(lot.chain.records)
            for e, element in enumerate(interface)
            for n, record in enumerate(element)
        ]
        self.places = {place: n for n, (place, _) in enumerate(records)}
        self._records = np.array([record for _, record in records])
        self._left: dict[str, Array] = {}
        self.laws = [law for _, law in _laws(lot.chain)]

    def left(self, name: str) -> Array:
        """A value of the records."""
        if name not in self._left:
            self._left[name] = picked(getattr(self._tally, f"element_{name}"), self._records)
        return self._left[name]

    @cached_property
    def stroke(self) -> Array:
        """Largest stroke [m]."""
        return self.left("stroke_max")

    @cached_property
    def lost(self) -> Array:
        """Energy that it has lost [J]."""
        return self.left("dissipated")

    @cached_property
    def _numbers(self) -> Array:
        """(4, n_case, n_law) devices that a law stands for, the force at which it breaks, its dashpot and stiffness."""
        values = self._lot.values(
            lambda chain: [
                (1.0 / e.share, e.breaks, law.loading.damping, law.loading.stiffness) for e, law in _laws(chain)
            ]
        )
        return np.ascontiguousarray(np.moveaxis(values, -1, 0))

    @property
    def breaks(self) -> BoolArray:
        """Whether it may break for good."""
        return np.asarray(self._numbers[1] < np.inf)

    def held(self, store: str) -> Array:
        """(n_case,) energy that all devices hold in one way: elastic, or in gas [J]; none where they have broken."""
        return added(picked(self._stored, [n for n, law in enumerate(self.laws) if law.kind.store == store]))

    @cached_property
    def _stored(self) -> Array:
        """Energy that all the devices it stands for hold [J]."""
        found = np.empty_like(self.stroke)
        names = ("stroke", "force", "state_0", "state_1")
        for some in self._alike:
            found[:, some.places] = some.kind.stored(some, *(picked(self.left(name), some.places) for name in names))
        return np.where(self.breaks & (self.left("force") == 0.0), 0.0, self._numbers[0] * found)

    def wasted(self, loss: str) -> Array:
        """(n_case,) energy that all devices lost other than by speed, in one way: crushed, or by friction [J]."""
        other = self._numbers[0] * self.lost - self._viscous
        return added(picked(other, [n for n, law in enumerate(self.laws) if law.kind.loss == loss]))

    @property
    def viscous(self) -> Array:
        """(n_case,) energy that all devices lost by speed [J]."""
        return added(self._viscous)

    @property
    def _viscous(self) -> Array:
        """Energy that all the devices it stands for lost by speed [J]."""
        return np.asarray(self._numbers[0] * self.left("viscous"))

    @cached_property
    def permanent(self) -> Array:
        """Stroke that remains [m]."""
        kept = np.empty_like(self.stroke)
        for some in self._alike:
            states = (picked(self.left(name), some.places) for name in ("state_0", "state_1"))
            kept[:, some.places] = some.kind.permanent(some, *states)
        back = self.stroke - kept
        return positive(self.stroke - back)

    @property
    def damped(self) -> BoolArray:
        """Whether a dashpot may add to what it absorbed."""
        return np.asarray(self._numbers[2] > 0.0)

    @cached_property
    def beside_curve(self) -> Array:
        """What it absorbed beside the area below its curve [J]; 0 where the area says nothing."""
        silent = self.breaks | ~np.array([law.kind.follows for law in self.laws])
        absorbed = self.absorbed(range(len(self.laws)), positive(self.stroke))
        return np.where(silent, 0.0, self.lost - absorbed)

    def absorbed(self, places: Sequence[int], stroke: Array) -> Array:
        """(n_case, k) what laws at k places absorb up to strokes (n_case, k) [m] by their curves at rest [J].

        That is the area below each curve, climbed as the law does, less what the device gives back.
        """
        n, path = self._paths
        passed = (path[0][:, places] <= stroke[..., None]).sum(axis=-1)
        at = np.maximum(np.minimum(passed, n[:, places]) - 1, 0)
        start, below, steep, done = path[:, np.arange(len(n))[:, None], places, at]
        reached = below + steep * (stroke - start)
        energy = done + 0.5 * (below + reached) * (stroke - start)
        return np.asarray(energy - 0.5 * reached * reached / self._numbers[3][:, places])

    @cached_property
    def _paths(self) -> tuple[IntArray, Array]:
        """The curves of first loading, climbed as the laws do.

        Returns:
            (n_case, n_law) how many points each has, and (4, n_case, n_law, most) their strokes, forces, the slopes
            behind them and the work up to them.
        """
        sizes = [law.loading.stroke.size for law in self.laws]
        widest = max(sizes, default=0)
        stated = self._lot.values(
            lambda chain: [_stated(law.loading, widest - law.loading.stroke.size) for _, law in _laws(chain)]
        )
        same = bool((stated == stated[:1]).all())  # of most sweeps
        found: dict[tuple[int, bytes], int] = {}  # how a curve is climbed depends on its numbers: each is once
        which = [
            [
                found.setdefault((size, values.tobytes()), len(found))
                for size, values in zip(sizes, of_case, strict=True)
            ]
            for of_case in (stated[:1] if same else stated)
        ]
        paths = [_climbed(size, np.frombuffer(values)) for size, values in found]
        most = max((path.stroke.size for path in paths), default=0)
        table = np.empty((4, len(paths), most))
        for k, path in enumerate(paths):
            points = (path.stroke, path.force, path.slope, work_along(path.stroke, path.force))
            for row, values in zip(table[:, k], points, strict=True):
                row[: values.size], row[values.size :] = values, values[-1]
        at = np.broadcast_to(np.array(which, dtype=int), stated.shape[:2])
        return np.array([path.stroke.size for path in paths], dtype=int)[at], table[:, at]

    @cached_property
    def _alike(self) -> list[_Alike]:
        """The laws in groups of one kind and, where a law has several curves, of one size."""
        groups: dict[tuple[Kind, tuple[int, ...]], list[int]] = {}
        for n, law in enumerate(self.laws):
            sizes = tuple(curve.size for curve in law.curves) if law.curves[1:] else ()
            groups.setdefault((law.kind, sizes), []).append(n)
        parameters = self._lot.values(lambda chain: [law.parameters for _, law in _laws(chain)])
        return [_Alike(self._lot, kind, places, parameters) for (kind, _), places in groups.items()]


class _Alike:
    """The numbers of some laws of one kind and size: (n_case, k) parameters, and curves (3, n_case, k, n)."""

    def __init__(self, lot: Lot, kind: Kind, places: list[int], parameters: Array) -> None:
        """Take the laws at k places."""
        self.kind, self.places, self._lot = kind, places, lot
        self.parameters = tuple(np.moveaxis(parameters[:, places], -1, 0))

    @cached_property
    def curves(self) -> tuple[Array, ...]:
        """Strokes, values and slopes of each curve."""
        n_curves = len(_some(self._lot.chain, self.places)[0].curves)
        return tuple(self._curve(n) for n in range(n_curves))

    def _curve(self, n: int) -> Array:
        """(3, n_case, k, n_point) those of one of the curves."""
        places = self.places
        values = self._lot.values(lambda chain: [law.curves[n] for law in _some(chain, places)])
        return np.ascontiguousarray(np.moveaxis(values, -2, 0))


def _stated(curve: Envelope, missing: int) -> list[float]:
    """The numbers of a curve, and zeros for so many points that others have more."""
    last = curve.stiffness, curve.damping, curve.last_slope
    return [*curve.stroke.tolist(), *curve.force.tolist(), *[0.0] * (2 * missing), *last]


def _climbed(size: int, stated: Array) -> Envelope:
    """What :func:`_stated` gave of a curve of so many points, climbed."""
    return Envelope(stated[:size], stated[size : 2 * size], *stated[-3:].tolist()).climbing


def _some(chain: Chain, places: Sequence[int]) -> list[Law]:
    """The laws at some places."""
    laws = [law for _, law in _laws(chain)]
    return [laws[place] for place in places]


def _laws(chain: Chain) -> Iterator[tuple[Element, Law]]:
    """Every law of a chain behind its element, in the order of the records."""
    for interface in chain.interfaces:
        for element in interface.elements:
            for law in element.laws:
                yield element, law
