"""Cases that tolerances make: from standard normal draws to vehicles and devices as they are built.

    scatter = scatter_of(scenario)
    scatter.names                # what scatters: "mass M1", "mass M2", "tubes M1-M2", ...
    scatter.cases(z)             # draws (n, d) -> n cases, each with its changes of the scenario
    fleet = together({"laden": scatter, "rear_leads": other})
    fleet.cases("laden", z)      # the same trains as built, in each of several load cases

What a tolerance scatters is one random quantity for all parts that have the value, or one for each of them; those go to
``as_built`` of the scenario, by the place of the vehicle or device.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtr

from trainmj.cases.rows import Values
from trainmj.collision.cases import Cases, Name
from trainmj.doe.arrays import FloatArray, as_matrix
from trainmj.doe.scatter import Marginal, correlation_root
from trainmj.errors import InputError
from trainmj.files.source import Path, Problem, dotted
from trainmj.scenario import Scenario
from trainmj.scenario.as_built import in_place, joints, standing
from trainmj.scenario.curves import CurveRef, listed
from trainmj.scenario.devices import CrushDevice
from trainmj.scenario.tolerances import Discrete, Lognormal, Normal, Tolerance

_OF_VEHICLES = ("mass_t", "length_m", "rail_friction", "load", "brakes", "body", "type")
"""What vehicles take over from their train, and a single one may be built with."""

Owner = tuple[Any, ...]
"""A vehicle or device by its train and position; empty for what belongs to the scenario."""

_SPREAD = "tolerance"
_PLACELESS = ""
"""The place of what belongs to the scenario, not to one vehicle or device."""


class _Value(NamedTuple):
    """A value that follows a random quantity."""

    column: int  # of the draws
    place: str  # of the vehicle or device that has it
    path: str  # below that
    at: Callable[[FloatArray], Any]  # values (n,) at standard normal draws (n,)


class _Curve(NamedTuple):
    """A curve, or the force of bolts, that is multiplied by what follows a random quantity."""

    column: int
    place: str
    path: str
    at: Callable[[FloatArray], Any]
    which: str  # stroke_mm or force_kN
    stated: dict[str, list[float]] | float  # stroke_mm and force_kN, or the force alone


@dataclass(frozen=True)
class Scatter:
    """What scatters in a scenario.

    Attributes:
        scenario: with the values around which it scatters.
        names: of the random quantities, (d,): that of the tolerance, and where each part has its own, its place.
        parts: the tolerance of each of them, (d,).
    """

    scenario: Scenario
    names: tuple[str, ...]
    parts: tuple[str, ...]
    _values: tuple[_Value, ...] = field(repr=False)
    _curves: tuple[_Curve, ...] = field(repr=False)
    _owners: tuple[Owner, ...] = field(repr=False)  # what each of them belongs to, wherever that stands
    _pairs: Mapping[tuple[int, int], float] = field(repr=False)  # coefficients of correlation, by two columns

    @property
    def d(self) -> int:
        """Number of random quantities."""
        return len(self.names)

    @cached_property
    def _alone(self) -> Together:
        return together({"": self})

    def scores(self, z: FloatArray) -> FloatArray:
        """The normal scores (n, d) of independent standard normal draws (n, d): correlated as stated."""
        return self._alone.scores(z)

    def cases(self, z: FloatArray) -> Cases:
        """The cases of independent standard normal draws (n, d), called by their numbers from 0 on."""
        return self._alone.cases("", z)

    def at(self, y: FloatArray) -> Cases:
        """The cases at normal scores (n, d), called by their numbers from 0 on."""
        found: dict[str, dict[Name, Values]] = {}
        for value in self._values:
            found.setdefault(value.place, {})[(value.path,)] = value.at(y[:, value.column])
        scaled: dict[tuple[str, str], Any] = {}
        for curve in self._curves:
            key, factor = (curve.place, curve.path), np.asarray(curve.at(y[:, curve.column]), dtype=np.float64)
            before = scaled.get(key, curve.stated)
            if isinstance(before, dict):
                scaled[key] = before | {curve.which: [x * factor for x in before[curve.which]]}
            else:
                scaled[key] = before * factor
        for (place, path), now in scaled.items():
            found.setdefault(place, {}).update(_of_curve(path, now, len(y)))
        columns = found.pop(_PLACELESS, {})
        for place, values in found.items():
            columns |= {("as_built", place, *name): column for name, column in values.items()}
        return Cases(range(len(y)), tuple(columns), tuple(columns.values()))


@dataclass(frozen=True)
class Together:
    """What scatters in one design that is collided in several load cases.

    What belongs to the same vehicle or device, or to all of them, is one random quantity, wherever it stands in a case:
    if the train runs the other way round, its last vehicle is M1.

    Attributes:
        scatters: by load case.
        names: of the random quantities, (d,); where a place is another vehicle or device in a later case, with that.
        parts: the tolerance of each of them, (d,).
        columns: which of them act in a load case.
    """

    scatters: Mapping[str, Scatter]
    names: tuple[str, ...]
    parts: tuple[str, ...]
    columns: Mapping[str, list[int]] = field(repr=False)
    _root: FloatArray | None = field(repr=False)

    @property
    def d(self) -> int:
        """Number of random quantities."""
        return len(self.names)

    def scores(self, z: FloatArray) -> FloatArray:
        """The normal scores (n, d) of independent standard normal draws (n, d): correlated as stated."""
        z = as_matrix("draws", z, self.d)
        return z if self._root is None else z @ self._root.T

    def cases(self, case: str, z: FloatArray) -> Cases:
        """The cases of a load case for independent standard normal draws (n, d), called by their numbers from 0 on."""
        return self.scatters[case].at(self.scores(z)[:, self.columns[case]])


def together(scatters: Mapping[str, Scatter]) -> Together:
    """What scatters in several load cases of one design, by case.

    Raises:
        InputError: if the correlations of all cases cannot hold at once.
    """
    known: dict[tuple[str, Owner], int] = {}
    names: list[str] = []
    columns: dict[str, list[int]] = {}
    pairs: dict[tuple[int, int], float] = {}
    for case, scatter in scatters.items():
        for key, name in zip(zip(scatter.parts, scatter._owners, strict=True), scatter.names, strict=True):
            if key not in known:
                known[key] = len(names)
                names.append(name if name not in names else f"{name} ({case})")
        columns[case] = [known[key] for key in zip(scatter.parts, scatter._owners, strict=True)]
        pairs |= {(columns[case][i], columns[case][j]): r for (i, j), r in scatter._pairs.items()}
    parts = tuple(part for part, _ in known)
    return Together(dict(scatters), tuple(names), parts, columns, _root(len(names), pairs))


def _root(d: int, pairs: Mapping[tuple[int, int], float]) -> FloatArray | None:
    """The lower triangular root of a matrix of correlations (d, d); None if all are independent.

    Raises:
        InputError: if no random quantities can be correlated in this way.
    """
    if not pairs:
        return None
    matrix = np.eye(d)
    for (i, j), coefficient in pairs.items():
        matrix[i, j] = matrix[j, i] = coefficient
    try:
        return correlation_root(matrix)
    except InputError as error:
        raise InputError(f"tolerances: {error}") from None


def _of_curve(path: str, now: Any, n: int) -> Iterator[tuple[Name, Values]]:
    """The columns of n curves, or of forces of bolts, of which strokes, forces or both have been scaled."""
    if not isinstance(now, dict):
        yield (path,), now
        return
    for which, numbers in now.items():
        if any(isinstance(x, np.ndarray) for x in numbers):
            yield from (((path, which, k), x) for k, x in enumerate(numbers))
        else:
            yield (path, which), [numbers] * n


def scatter_of(scenario: Scenario) -> Scatter:
    """What scatters in a scenario, by its tolerances.

    Raises:
        InputError: with the place of each tolerance that leads to no value, or does not fit what it leads to.
    """
    if not scenario.tolerances:
        raise InputError("tolerances: the scenario has none: state what scatters")
    if scenario.as_built:
        raise InputError("as_built: does not go with tolerances, which scatter around what is stated for all")
    found = _Found(scenario)
    pairs = found.pairs()
    scenario.refuse(found.problems)
    owner = _owners(scenario)
    scatter = Scatter(
        scenario,
        tuple(found.names),
        tuple(found.parts),
        tuple(found.values),
        tuple(found.curves),
        tuple(owner[place] for place in found.places),
        pairs,
    )
    together({"": scatter})  # refuses correlations that cannot hold
    return scatter


def _owners(scenario: Scenario) -> dict[str, Owner]:
    """The vehicle or device at each place, told apart by its train and its position in that."""
    vehicles = {at.place: at for at in standing(scenario)}
    found: dict[str, Owner] = {_PLACELESS: ()}
    found |= {place: (place[0], at.train, at.position) for place, at in vehicles.items()}
    front, *behind = joints(scenario)
    c = scenario.collision
    fronts = (("M", c.train, "end", c.train_end), ("S", c.partner, "end", c.partner_end))
    found |= dict(zip(front.places, fronts, strict=False))
    for joint in behind:
        ends = [vehicles[name] for name in joint.name.split("-")]
        between = tuple(sorted(at.position for at in ends))
        for place in joint.places:
            own = vehicles.get(place.removeprefix(f"{joint.name} "))
            found[place] = (joint.name[0], ends[0].train, between, own.position if own else None)
    return found


class _Found:
    """What the tolerances of a scenario lead to, and what is wrong with them."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.names: list[str] = []
        self.parts: list[str] = []
        self.places: list[str] = []  # of each random quantity
        self.values: list[_Value] = []
        self.curves: list[_Curve] = []
        self.problems: list[Problem] = []
        self.through: set[tuple[str, str]] = set()  # named curves that a device has, with the tolerance that scales it
        self._standing = list(standing(scenario))
        self._installed = [at for joint in joints(scenario) for at in joint.devices]
        targets = {name: list(self._targets(name, part)) for name, part in scenario.tolerances.items()}
        self._own = {  # trains and devices of which single ones differ
            path[:2]
            for name, paths in targets.items()
            for path in paths
            if scenario.tolerances[name].copies == "independent"
        }
        for name, paths in targets.items():
            self._add(name, scenario.tolerances[name], paths)
        self._check_apart()
        self._check_in_place()

    def _targets(self, name: str, tolerance: Tolerance) -> Iterator[Path]:
        for target in tolerance.targets:
            try:
                yield from self.scenario.places(target)
            except InputError as error:
                self.problems.append(Problem(("tolerances", name, "of"), str(error)))

    def _add(self, name: str, tolerance: Tolerance, paths: list[Path]) -> None:
        """The random quantities of a tolerance, and the values that follow them."""
        owners = {path: self._owners(path) for path in paths}
        if tolerance.copies is None and (several := max(map(len, owners.values()), default=0)) > 1:
            rule = f"leads to {several} vehicles or devices: state copies: independent, or same for one draw for all"
            self.problems.append(Problem(("tolerances", name), rule))
            return
        columns: dict[str, int] = {}
        if tolerance.scales and (twice := self.scenario.twice(tolerance.targets)):
            both = " and ".join(dict.fromkeys(twice))
            self.problems.append(Problem(("tolerances", name, "of"), f"leads to one curve twice, by {both}"))
            return
        for path in paths:
            own = tolerance.copies == "independent"
            if own and not owners[path]:
                rule = f"copies: independent is for values of vehicles and devices: {dotted(path)} is none, or not used"
                self.problems.append(Problem(("tolerances", name, "copies"), rule))
                return
            single = own or (path[:2] in self._own and owners[path])
            for place in owners[path] if single else [_PLACELESS]:
                column = columns.setdefault(place if own else _PLACELESS, len(self.names))
                if column == len(self.names):
                    self.names.append(f"{name} {place}" if own else name)
                    self.parts.append(name)
                    self.places.append(place if own else _PLACELESS)
                self._follow(name, tolerance, path, column, place)

    def _owners(self, path: Path) -> list[str]:
        """The places of the vehicles or devices that have the value at a path."""
        match path:
            case ("devices", device, *_):
                return [at.place for at in self._installed if at.device == device]
            case ("trains", train, "vehicles", int(position), _, *_):
                return [at.place for at in self._standing if (at.train, at.position) == (train, position)]
            case ("trains", train, key, *inner) if key in _OF_VEHICLES:
                vehicles = self.scenario.trains[str(train)].each()

                def takes_over(own: Any) -> bool:
                    return own is None or (key == "load" and bool(inner) and getattr(own, str(inner[0])) is None)

                return [
                    at.place
                    for at in self._standing
                    if at.train == train and takes_over(getattr(vehicles[at.position], key))
                ]
        return []

    def _follow(self, name: str, tolerance: Tolerance, path: Path, column: int, place: str) -> None:
        """Let what is at a path, or that of the vehicle or device at a place, follow a random quantity."""
        below = path
        if place:
            below = path[4:] if path[2:3] == ("vehicles",) else path[2:]
        if not (below or tolerance.scales):
            rule = f"is a whole device, of which single ones cannot be others: state its values, such as {dotted(path)}"
            self.problems.append(Problem(("tolerances", name, "of"), f"{rule}.stiffness_kN_per_mm"))
            return
        if tolerance.scales:
            at = _distributed(tolerance, 1.0)
            found = list(self._scaled(path, tolerance.scales))
            if not found:
                rule = f"scales {tolerance.scales}: {dotted(path)} is no curve, and no device or stage that has one"
                self.problems.append(Problem(("tolerances", name, "of"), rule))
            which = "force_kN" if tolerance.scales == "force" else "stroke_mm"
            for inner, stated in found:
                (ref,) = self.scenario.locate(dotted(inner))
                self.through |= {(curve, name) for _, curve in listed(ref) if isinstance(curve, str)}
                to = dotted((*below, *inner[len(path) :]))
                self.curves.append(_Curve(column, place, to, at, which, stated))
            return
        (value,) = self.scenario.locate(dotted(path))
        whole = isinstance(tolerance, Discrete) or (
            value is None and (tolerance.range is not None or _mean_of(tolerance) is not None)
        )
        if not whole and (isinstance(value, bool) or not isinstance(value, int | float)):
            cure = "state scales: force or stroke" if isinstance(value, dict | list | str) else "state the value"
            self.problems.append(Problem(("tolerances", name, "of"), f"{dotted(path)} is no number: {cure}"))
            return
        try:
            self.values.append(_Value(column, place, dotted(below), _distributed(tolerance, value)))
        except InputError as error:
            self.problems.append(Problem(("tolerances", name), f"{dotted(path)} = {value}: {error}"))

    def _scaled(self, path: Path, what: str) -> Iterator[tuple[Path, dict[str, list[float]] | float]]:
        """The curves at a path and below it, and the forces of bolts, with what is stated."""
        match path:
            case ("curves", name):
                curve: CurveRef = str(name)
                yield path, self._points(curve)
            case ("devices", name, *_):
                device = self.scenario.devices[str(name)]
                whole = path[2:] == ()  # a draw gear alone is not the device
                for at, ref in device.curves() if any(device.own_curves()) or not whole else ():
                    inner = ("devices", name, *at)
                    if inner[: len(path)] == path:
                        yield inner, self._points(ref)
                if what == "force" and isinstance(device, CrushDevice):
                    for stage, spec in device.all_stages().items():
                        inner = ("devices", name, *device.place_of(stage), "shear_off", "force_kN")
                        if spec.shear_off is not None and inner[: len(path)] == path:
                            yield inner, spec.shear_off.force_kN

    def _points(self, curve: CurveRef) -> dict[str, list[float]]:
        """The points of a curve, as one is stated in a scenario."""
        stroke, force = self.scenario.curve_points(curve)
        return {"stroke_mm": stroke, "force_kN": force}

    def _check_apart(self) -> None:
        """No value is set by two tolerances; factors of one curve multiply."""
        owner: dict[tuple[str, str], str] = {}
        factors = {(curve.place, curve.path): self.parts[curve.column] for curve in self.curves}
        for value in self.values:
            name, key = self.parts[value.column], (value.place, value.path)
            other = owner.setdefault(key, name)
            inside = next((of for (place, path), of in factors.items() if _within(key, (place, path))), None)
            if other != name or inside:
                rule = f"sets {value.path}, as {inside or other} does: leave one of them out"
                self.problems.append(Problem(("tolerances", name), rule))
        for curve, other in sorted(self.through):  # a device is given the points of its curves, not their names
            changed = [(p.column, p.path) for p in self.values if not p.place]
            changed += [(p.column, p.path) for p in self.curves if not p.place]
            for column, path in changed:
                name = self.parts[column]
                if name != other and _within((_PLACELESS, path), (_PLACELESS, f"curves.{curve}")):
                    rule = f"changes the curve {curve}, which {other} scales in a device that has it: scale the device"
                    self.problems.append(Problem(("tolerances", name, "of"), f"{rule} in both, or the curve"))

    def _check_in_place(self) -> None:
        """Where single vehicles and devices differ, no draw puts others in their places."""
        single = {value.place for value in self.values} | {curve.place for curve in self.curves}
        single -= {_PLACELESS}
        here = in_place(self.scenario, single)
        for value in self.values if single else ():
            name = self.parts[value.column]
            tolerance = self.scenario.tolerances[name]
            for other in tolerance.values if isinstance(tolerance, Discrete) and not value.place else ():
                try:
                    there = in_place(self.scenario.with_values({value.path: other}), single)
                except InputError:
                    continue  # the row of the draw says why
                if there != here:
                    rule = f"with {other!r} others stand where single vehicles or devices differ: make it a load case"
                    self.problems.append(Problem(("tolerances", name), rule))
                    break

    def pairs(self) -> dict[tuple[int, int], float]:
        """Coefficients of correlation by two columns: of quantities of one place, or of which one has none."""
        found: dict[tuple[int, int], float] = {}
        columns: dict[str, list[int]] = {}
        for column, part in enumerate(self.parts):
            columns.setdefault(part, []).append(column)
        for name, tolerance in self.scenario.tolerances.items():
            for other, coefficient in tolerance.correlated.items():
                both = [(i, j) for i in columns.get(name, ()) for j in columns.get(other, ())]
                meant = [(i, j) for i, j in both if self.places[i] == self.places[j] or not all(self._places(i, j))]
                found |= dict.fromkeys(meant, coefficient)
                if both and not meant:
                    rule = f"no vehicle or device has both {name} and {other}: state copies: same for one of them"
                    self.problems.append(Problem(("tolerances", name, "correlated", other), rule))
        return found

    def _places(self, *columns: int) -> tuple[str, ...]:
        return tuple(self.places[column] for column in columns)


def _within(inner: tuple[str, str], outer: tuple[str, str]) -> bool:
    """Whether a path is another one, or leads into it, at the same place."""
    return inner[0] == outer[0] and (inner[1] == outer[1] or inner[1].startswith(f"{outer[1]}."))


def _mean_of(tolerance: Tolerance) -> float | None:
    """The mean that a tolerance states; None if it is the value in the scenario."""
    return getattr(tolerance, "mean", None)


def _distributed(tolerance: Tolerance, nominal: Any) -> Callable[[FloatArray], Any]:
    """The values (n,) of a tolerance around a nominal value at standard normal draws (n,).

    Raises:
        InputError: if the distribution cannot be one around this value.
    """
    if isinstance(tolerance, Discrete):
        values = tolerance.values
        shares = tolerance.probabilities or [1.0 / len(values)] * len(values)
        ends = np.cumsum(shares)[:-1]
        return lambda z: [values[k] for k in np.searchsorted(ends, ndtr(z), side="right")]
    range_, percent = tolerance.range, (tolerance.percent or 0.0) / 100.0
    stated = _mean_of(tolerance)
    mean = (nominal or 0.0) if stated is None else stated
    if tolerance.percent and not mean:
        raise InputError("a percentage of 0 is no tolerance: state sigma or range")
    if tolerance.kind == "uniform":
        half = abs(mean) * percent
        return Marginal.uniform(_SPREAD, *(range_ or (mean - half, mean + half))).at_normal
    sigma = tolerance.sigma or abs(mean) * percent
    if isinstance(tolerance, Normal):
        if range_:
            mean, sigma = 0.5 * (range_[0] + range_[1]), (range_[1] - range_[0]) / 6.0
        return lambda z: mean + sigma * z
    if isinstance(tolerance, Lognormal):
        if range_:
            low, high = math.log(range_[0]), math.log(range_[1])
            wide = ((high - low) / 6.0) ** 2
            mean = math.exp(0.5 * (low + high + wide))
            sigma = mean * math.sqrt(math.expm1(wide))
        if mean <= 0:
            raise InputError("a lognormal distribution needs a mean above 0")
        return Marginal.lognormal(_SPREAD, mean, sigma).at_normal
    reach = (tolerance.cut_sigma or 0.0) * sigma
    low, high = range_ or (mean - reach, mean + reach)
    if not low < mean < high:
        raise InputError(f"the mean, {mean:g}, must lie in the range from {low:g} to {high:g}")
    return Marginal.truncated_normal(_SPREAD, mean, sigma, low, high).at_normal
