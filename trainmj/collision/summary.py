"""From a computed collision to what a crashworthiness engineer reads: strokes, energies, accelerations, TS, TAMA.

The quantities themselves are in :mod:`trainmj.collision.quantities`; here they are put together for one collision.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.block import Tally
from trainmj.collision.chain import Chain, n_own_sides, order_of_vehicles
from trainmj.collision.channels import Trace
from trainmj.collision.envelope import Array
from trainmj.collision.limits import Criterion, of_responses, of_stages
from trainmj.collision.line import Line
from trainmj.collision.measured import UNSTABLE, Measured, Side
from trainmj.collision.quantities import (
    COLLISION,
    STAGE,
    TRAIN,
    Column,
    Quantity,
    columns_of,
    names_of_parts,
    of_balance,
    of_interfaces,
    of_sides,
    of_train,
    of_vehicles,
    parts_of,
    with_column,
)
from trainmj.collision.records import (
    ContactWindow,
    FaceUse,
    InterfaceMetrics,
    Numbers,
    PartMetrics,
    StageUse,
    VehicleMetrics,
)
from trainmj.collision.remarks import remarks, remarks_of
from trainmj.collision.result import Result, result_given
from trainmj.collision.status import Kind, Status, not_valid
from trainmj.collision.verdict import verdict
from trainmj.files.arguments import chosen_of
from trainmj.files.shown import Shown
from trainmj.files.written import finite
from trainmj.scenario.devices import DEVICE
from trainmj.units import KJ, MM, G

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Summary(Shown, Numbers):
    """All numbers of a collision in engineering units.

    Its own numbers are those of :data:`trainmj.collision.quantities.TRAIN` and ``COLLISION``: ``TS_mm``, ``TAMA_g``,
    ``duration_s``.

    Attributes:
        status: how it ended; its text is ``str(status)``.
        interfaces: from the front backwards, the moving train first.
        vehicles: likewise.
        balance: where energy and momentum went, the numbers of :data:`trainmj.collision.quantities.BALANCE`.
        limits: every limit beside what was found: those of the scenario, then the strokes of stages.
        remarks: what is computed otherwise than one might read the scenario, a sentence each.
        responses: every response by the name of its column, in the order of tables: ``stroke_S1_M1_mm``.
        columns: what the responses are, by the same names.
        channels: those that a batch was asked for, by name: ``velocity_M1_km_h``.
        over: whether no device was pressed any more; otherwise the time limit cut it off.
    """

    status: Status
    interfaces: tuple[InterfaceMetrics, ...]
    vehicles: tuple[VehicleMetrics, ...]
    balance: Numbers
    limits: tuple[Criterion, ...]
    remarks: tuple[str, ...]
    responses: Mapping[str, float] = field(repr=False)
    columns: Mapping[str, Column] = field(repr=False, compare=False)
    channels: Mapping[str, Trace] = field(default_factory=dict, repr=False, compare=False)
    over: bool = True

    @property
    def not_valid(self) -> str:
        """What marks its numbers where a curve ended behind which nothing is stated: "not valid after 0.213 s"."""
        return not_valid(self.values["valid_until_s"])

    @property
    def gave_way(self) -> list[str]:
        """Car bodies under test that gave way, with by how much: "body of M1 (crushed by 3.1 mm)"."""
        found = [(i, stage) for i in self.interfaces if i.judged for stage in i.stages if stage.collapsed]
        bodies = [said for vehicle in self.vehicles if vehicle.judged for _, said in _collapsed(vehicle)]
        return [_crushed(_place(*one), one[1]) for one in found] + bodies

    def __repr__(self) -> str:
        """Status, criteria and verdict: a summary holds every number."""
        of = {q.name: q for q in TRAIN if q.name in self.values}
        said = ", ".join(f"{q.heading} {q.text(self.values[name])} {q.unit}".rstrip() for name, q in of.items())
        return f"<Summary {self.status}; {said}. {verdict(self).text}>"

    def to_frame(self, of: str = "responses") -> pd.DataFrame:
        """The numbers as a table.

        Args:
            of: what has a row each: "responses", "interfaces", "stages", "vehicles" or "limits". Responses come with
                value, unit and title, in the order of ``columns``; all others with units in the heads.

        Raises:
            InputError: if there is no such table.
        """
        import pandas as pd

        rows: dict[str, list[dict[str, Any]]] = {
            "responses": [
                {"response": name, "value": value, "unit": self.columns[name].unit, "title": self.columns[name].title}
                for name, value in self.responses.items()
            ],
            "interfaces": [i.as_row() for i in self.interfaces],
            "stages": [{"interface": i.name, "device": i.device, **vars(s)} for i in self.interfaces for s in i.stages],
            "vehicles": [v.as_row() for v in self.vehicles],
            "limits": [criterion.as_dict() for criterion in self.limits],
        }
        frame = pd.DataFrame(chosen_of(rows, of, "table"))
        return frame.set_index(frame.columns[0]) if len(frame) else frame

    def row(self) -> dict[str, Any]:
        """Status, reason and every response by the name of its column."""
        return {"status": self.status.kind.value, "reason": self.status.reason, **self.responses}

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj run --json`` prints them; None for NaN and infinity, which JSON cannot hold."""
        plain: dict[str, Any] = finite(
            {
                "status": self.status.kind.value,
                "where": self.status.where,
                "reason": self.status.reason,
                "valid": not self.not_valid,
                "criteria": _of(self.values, [q for q in TRAIN if q.name in self.values]),
                **_of(self.values, COLLISION),
                "interfaces": [i.as_dict() for i in self.interfaces],
                "vehicles": [v.as_dict() for v in self.vehicles],
                "balance": self.balance.values,
                "limits": [criterion.as_dict() for criterion in self.limits],
                "remarks": self.remarks,
            }
        )
        return plain


def _shown(numbers: Numbers, quantities: tuple[Quantity[Any], ...]) -> list[float]:
    """The numbers that have a column."""
    values = numbers.values
    return [values[name] for name in _names(quantities)]


@cache
def _names(quantities: tuple[Quantity[Any], ...]) -> tuple[str, ...]:
    """Names of the quantities that have a column."""
    return tuple(quantity.name for quantity in with_column(quantities))


def _of(values: Mapping[str, float], quantities: Iterable[Quantity[Any]]) -> dict[str, float]:
    return {q.name: values[q.name] for q in quantities}


def summarise(result: Result | str | Path) -> Summary:
    """The numbers of one computed collision."""
    result = result_given(result)
    return measure(result.chain, result.tally, result.time, result.velocity)


def measure(chain: Chain, tally: Tally, time: Array, velocity: Array) -> Summary:
    """The numbers of a collision from its tally and recorded speeds.

    Args:
        chain: what was collided.
        tally: from every step.
        time: (n_sample,) [s], evenly spaced.
        velocity: (n_sample, n_vehicle) [m/s].
    """
    return summary_of(Measured(chain, tally, time, np.asfortranarray(velocity)))  # the speeds of a vehicle side by side


def summary_of(measured: Measured) -> Summary:
    """The numbers of a collision that has been measured."""
    chain = measured.chain
    own = n_own_sides(chain)
    sides = of_sides(chain)
    interfaces = tuple(_interface(side, sides, chain.twin or n < own) for n, side in enumerate(measured.sides))
    quantities = of_vehicles(chain)
    names = [q.name for q in quantities]
    blank = np.full(len(chain.vehicles), np.nan)
    values = (np.asarray(q.value(measured) if q.is_number(chain) else blank, dtype=np.float64) for q in quantities)
    numbers = list(zip(*(value.tolist() for value in values), strict=True))
    parts = {kind: _of_parts(measured, table) for kind, table in parts_of(chain)}
    vehicles = tuple(
        VehicleMetrics(
            dict(zip(names, numbers[i], strict=True)),
            chain.vehicles[i].name,
            chain.vehicles[i].kind,
            **{
                kind: tuple(PartMetrics(of[k], name) for k, name in names_of_parts(chain, kind, i))
                for kind, of in parts.items()
            },
            contacts=tuple(
                ContactWindow(start, end, mean / G, cut) for start, end, mean, cut in measured.contacts_of(i)
            ),
            used_up=any(measured.tally.member_end_time[k] >= 0.0 for k in chain.members_inward(i)),
            judged=chain.twin or i < chain.n_moving,
        )
        for i in order_of_vehicles(chain)
    )
    balance = Numbers({q.name: q.value(measured) for q in of_balance(chain)})
    whole = Numbers({q.name: q.value(measured) for q in (*of_train(chain), *COLLISION)})
    columns = columns_of(chain)
    responses = dict(zip(columns, _responses(chain, whole, balance, interfaces, vehicles), strict=True))
    found = (*of_responses(chain, columns, responses, interfaces, vehicles), *of_stages(chain, interfaces))
    limits = tuple(replace(criterion, valid=measured.tally.valid_until == math.inf) for criterion in found)
    status = _status(measured, interfaces, vehicles, balance, limits)
    said = (*remarks(chain), *remarks_of(measured), *_of_partner(interfaces, vehicles))
    over = bool(measured.tally.over)
    return Summary(whole.values, status, interfaces, vehicles, balance, limits, said, responses, columns, over=over)


def _responses(
    chain: Chain,
    whole: Numbers,
    balance: Numbers,
    interfaces: Iterable[InterfaceMetrics],
    vehicles: Iterable[VehicleMetrics],
) -> list[float]:
    """Every number that has a column, in the order of the columns."""
    values = [*_shown(whole, (*of_train(chain), *COLLISION)), *_shown(balance, of_balance(chain))]
    for i in interfaces:
        values += [i.values[q.name] for q in of_interfaces(of_sides(chain), i.draws)]
        values += [stage.stroke_mm for stage in i.stages if stage.name != DEVICE] if len(i.stages) > 1 else []
    quantities = of_vehicles(chain)
    for v in vehicles:
        values += _shown(v, quantities)
        for kind, table in parts_of(chain):
            values += [part.values[q.name] for q in with_column(table) for part in getattr(v, kind)]
    return values


def _of_parts(measured: Measured, table: tuple[Quantity[Measured], ...]) -> list[dict[str, float]]:
    """The numbers of each part of a kind, such as a member of a body that gives, by its index."""
    numbers = [np.asarray(q.value(measured)).tolist() for q in table]
    names = [q.name for q in table]
    return [dict(zip(names, of_one, strict=True)) for of_one in zip(*numbers, strict=True)]


def _interface(side: Side, quantities: tuple[Quantity[Side], ...], judged: bool) -> InterfaceMetrics:
    return InterfaceMetrics(
        {q.name: q.value(side) for q in quantities},
        name=side.name,
        device=side.device.name,
        stages=tuple(
            StageUse(s.name, STAGE.value(stroke), s.limit / MM if s.limit < np.inf else None, energy / KJ)
            for s, stroke, energy in side.stages
        ),
        beyond_curve=side.end_time < np.inf,
        draws=side.interface.draws,
        drawn_out=side.drawn_out,
        judged=judged,
        slid=tuple(_slid(*one) for one in side.slid),
        faces=tuple(
            FaceUse(name, line.overlap / MM, *(None if math.isnan(v) else v for v in (met / MM, off)))
            for name, line, met, off in side.faces
        ),
    )


def _slid(stage: str, line: Line, time: float) -> str:
    how = "its pins met" if line.strut else f"past its {line.overlap / MM:.6g} mm of overlap"
    return f"{stage} at {time:.4g} s ({how})"


def _status(
    measured: Measured,
    interfaces: Iterable[InterfaceMetrics],
    vehicles: Iterable[VehicleMetrics],
    balance: Numbers,
    limits: Iterable[Criterion],
) -> Status:
    tally, energy_error = measured.tally, balance.energy_error
    if not (np.isfinite(energy_error) and np.isfinite(tally.stroke_max).all()):
        return Status(Kind.UNSTABLE, detail="a value is not finite; take a smaller step")
    if abs(energy_error) > UNSTABLE:
        return Status(
            Kind.UNSTABLE, detail=f"the energy balance is off by {abs(energy_error):.2%}; take a smaller step"
        )
    if balance.curve_error > UNSTABLE:
        side = measured.curve_error[1]
        return Status(
            Kind.UNSTABLE,
            detail=f"{side.device.name} at {side.name} absorbed {side.energy / KJ:.4g} kJ, and the area below its "
            f"curve is {side.energy_by_curve / KJ:.4g} kJ; take a smaller step",
        )
    if tally.first_force_time.max() < 0.0:
        return Status(
            Kind.NO_CONTACT,
            detail="the two sides came to rest, or stopped coming closer, before a device was pressed"
            if tally.over
            else "no device was pressed before the time limit",
        )
    slid = [(i.name, f"{i.name} {one}") for i in interfaces for one in i.slid]
    ended = [(i.name, _ended(i)) for i in interfaces if i.beyond_curve]
    ended += [
        (f"body of {v.name}", f"body of {v.name} (a member shortened by its whole length)")
        for v in vehicles
        if v.used_up
    ]
    spent = [one for interface in interfaces if interface.judged for one in _spent(interface)]
    spent += [one for vehicle in vehicles if vehicle.judged for one in _collapsed(vehicle)]
    passed = ", ".join(c.said for c in limits if c.of_scenario and not c.kept)
    cut = "" if tally.over else "; cut off by the time limit"
    if slid:
        where, said = zip(*slid, strict=True)
        also = f"; {Kind.CURVE_ENDED} at {', '.join(one for _, one in ended)}" if ended else ""
        return Status(Kind.OVERRIDE, where, f"{', '.join(said)}{also}; {not_valid(tally.valid_until)}{cut}")
    if ended:
        where, said = zip(*ended, strict=True)
        return Status(Kind.CURVE_ENDED, where, f"{', '.join(said)}; {not_valid(tally.valid_until)}{cut}")
    if spent:
        where, said = zip(*spent, strict=True)
        more = f"; {Kind.LIMIT}: {passed}" if passed else ""
        return Status(Kind.EXHAUSTED, tuple(where), ", ".join(said) + more + cut)
    if passed:
        return Status(Kind.LIMIT, detail=passed + cut)
    return Status(Kind.OVER if tally.over else Kind.TIME_LIMIT)


def _ended(interface: InterfaceMetrics) -> str:
    """An interface whose device went past the end of its curve, with its stroke."""
    if interface.drawn_out:
        return f"{interface.name} (drawn past the end of the curve of the draw gear of {interface.device})"
    return f"{interface.name} ({interface.stroke_mm:.1f} mm, past the end of the curve of {interface.device})"


def _of_partner(interfaces: Iterable[InterfaceMetrics], vehicles: Iterable[VehicleMetrics]) -> Iterator[str]:
    """What of the partner, which is not judged, passed its limits or gave way."""
    found = [said for interface in interfaces if not interface.judged for _, said in _spent(interface)]
    found += [said for vehicle in vehicles if not vehicle.judged for _, said in _collapsed(vehicle)]
    if found:
        yield f"The partner, which is not judged, passed limits of its own: {', '.join(found)}."


def _collapsed(vehicle: VehicleMetrics) -> Iterator[tuple[str, str]]:
    """A body that gave way, with by how much."""
    if vehicle.collapsed:
        how = "crushed" if vehicle.body_plastic_mm > 0.0 else "drawn out"
        where = f"body of {vehicle.name}"
        yield where, f"{where} ({how} by {abs(vehicle.body_plastic_mm):.1f} mm)"


def _spent(interface: InterfaceMetrics) -> Iterator[tuple[str, str]]:
    """Each stage that passed its limit, and a car body that gave way, with the numbers."""
    for stage in interface.stages:
        where = _place(interface, stage)
        if stage.exhausted:
            found = STAGE.text(stage.stroke_mm, stage.limit_mm)
            yield where, f"{where} ({found} of {stage.limit_mm:.12g} mm)"
        elif stage.collapsed:
            yield where, _crushed(where, stage)


def _place(interface: InterfaceMetrics, stage: StageUse) -> str:
    """Where a stage is: the interface, and the stage if it is one of several."""
    return f"{interface.name} {stage.name}" if len(interface.stages) > 1 else interface.name


def _crushed(where: str, stage: StageUse) -> str:
    return f"{where} (crushed by {STAGE.text(stage.stroke_mm)} mm)"
