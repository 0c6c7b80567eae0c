"""From a computed collision to what a crashworthiness engineer reads: strokes, energies, accelerations, TS, TAMA.

The quantities themselves are in :mod:`trainmj.collision.quantities`; here they are put together for one collision.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.block import Tally
from trainmj.collision.chain import Chain, order_of_vehicles
from trainmj.collision.channels import Trace
from trainmj.collision.ending import collapsed, crushed, place
from trainmj.collision.envelope import Array
from trainmj.collision.found import Found
from trainmj.collision.limits import Criterion
from trainmj.collision.measured import Measured
from trainmj.collision.quantities import (
    COLLISION,
    TRAIN,
    Column,
    Quantity,
    names_of_parts,
    of_balance,
    of_sides,
    of_train,
    of_vehicles,
    parts_of,
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
from trainmj.collision.result import Result
from trainmj.collision.saved import result_given
from trainmj.collision.status import Status, not_valid
from trainmj.collision.verdict import verdict
from trainmj.files.arguments import chosen_of
from trainmj.files.shown import Shown
from trainmj.files.written import finite
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
        stages = [crushed(place(i.name, len(i.stages), stage.name), stage.stroke_mm) for i, stage in found]
        vehicles = [vehicle for vehicle in self.vehicles if vehicle.judged and vehicle.collapsed]
        return stages + [collapsed(vehicle.name, vehicle.body_plastic_mm) for vehicle in vehicles]

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


def _of(values: Mapping[str, float], quantities: Iterable[Quantity]) -> dict[str, float]:
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
    return summary_of(Found(Measured.of_one(chain, tally, time, velocity)))


@np.errstate(all="ignore")
def summary_of(found: Found, case: int = 0) -> Summary:
    """The numbers of one case of a lot."""
    if len(found) > 1:
        return summary_of(Found(found.measured.take(np.array([case]))))
    measured, chain = found.measured, found.measured.lot.chain_of(0)
    interfaces, vehicles = _interfaces(found), _vehicles(found, chain)
    balance = Numbers(_numbers(found, of_balance(chain)))
    whole = _numbers(found, (*of_train(chain), *COLLISION))
    partner = [said for _, said in found.endings.spent(0, False)]
    said = (*remarks(chain), *remarks_of(measured), *found.endings.coarse.remarks(0), *_of_partner(partner))
    return Summary(
        whole,
        found.endings.of(0),
        interfaces,
        vehicles,
        balance,
        tuple(one.of(0) for one in found.limits),
        said,
        dict(zip(found.columns, _plain(found.numbers[0]), strict=True)),
        found.columns,
        over=bool(found.over[0]),
    )


def _numbers(found: Found, quantities: Iterable[Quantity]) -> dict[str, float]:
    """Quantities of the whole of the one case by name."""
    return {q.name: _plain(found.values.of(q)[0])[0] for q in quantities}


def _plain(numbers: Array) -> list[float]:
    """Numbers (n,) one by one; all that are none are the same object, so that equal summaries are equal."""
    return [number if number == number else math.nan for number in numbers.tolist()]


def _rows(found: Found, quantities: Iterable[Quantity]) -> list[dict[str, float]]:
    """The same of each vehicle, interface or part."""
    numbers = {q.name: _plain(found.values.of(q)[0]) for q in quantities}
    return [dict(zip(numbers, row, strict=True)) for row in zip(*numbers.values(), strict=True)]


def _interfaces(found: Found) -> tuple[InterfaceMetrics, ...]:
    """The interfaces of the one case."""
    chain, sides = found.measured.chain, found.measured.sides
    stages: list[list[StageUse]] = [[] for _ in sides.places]
    numbers = (sides.stage_stroke / MM, sides.stage_limit / MM, sides.stage_energy / KJ)
    for stage, *of_stage in zip(sides.stages, *(values[0].tolist() for values in numbers), strict=True):
        stroke, limit, energy = of_stage
        stages[stage.side].append(StageUse(stage.name, stroke, limit if limit < np.inf else None, energy))
    ended, drawn_out = (sides.end_time[0] < np.inf).tolist(), sides.drawn_out[0].tolist()
    return tuple(
        InterfaceMetrics(
            numbers_of_side,
            name=sides.names[n],
            device=sides.devices[n],
            stages=tuple(stages[n]),
            beyond_curve=ended[n],
            draws=sides.interfaces[n].draws,
            drawn_out=drawn_out[n],
            judged=sides.judged[n],
            slid=tuple(found.endings.slid(0, n)),
            faces=tuple(_faces(found, n)),
        )
        for n, numbers_of_side in enumerate(_rows(found, of_sides(chain)))
    )


def _faces(found: Found, side: int) -> Iterator[FaceUse]:
    """The stages of a side that have faces."""
    sides, lines = found.measured.sides, found.measured.chain.lines
    for stage, line in sides.on_lines(side):
        if not lines[line].strut:
            met, off = float(sides.met[0, line]) / MM, float(sides.off_time[0, line])
            found_there = (None if math.isnan(value) else value for value in (met, off))
            yield FaceUse(stage, float(sides.overlap[0, line]) / MM, *found_there)


def _vehicles(found: Found, chain: Chain) -> tuple[VehicleMetrics, ...]:
    """The vehicles of the one case, from the front backwards."""
    measured, rows = found.measured, _rows(found, of_vehicles(chain))
    parts = {kind: _rows(found, table) for kind, table in parts_of(chain)}
    used_up = measured.used_up[0].tolist()
    return tuple(
        VehicleMetrics(
            rows[i],
            chain.vehicles[i].name,
            chain.vehicles[i].kind,
            **{
                kind: tuple(PartMetrics(of[k], name) for k, name in names_of_parts(chain, kind, i))
                for kind, of in parts.items()
            },
            contacts=tuple(
                ContactWindow(start, end, mean / G, cut) for start, end, mean, cut in measured.contacts_of(0, i)
            ),
            used_up=used_up[i],
            judged=chain.twin or i < chain.n_moving,
        )
        for i in order_of_vehicles(chain)
    )


def _of_partner(said: Sequence[str]) -> Iterator[str]:
    """What of the partner, which is not judged, passed its limits or gave way."""
    if said:
        yield f"The partner, which is not judged, passed limits of its own: {', '.join(said)}."
