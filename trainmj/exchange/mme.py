"""A result as an ISO-MME folder (ISO/TS 13499), which the programs of crash laboratories read.

The moving train is test object 1, its partner test object 2. A code counts vehicles from the impact, and interfaces
from the front: ``10VEHC03CG00ACX0`` is the acceleration of the centre of gravity of M3, ``102IFC020000FOX0`` the force
of the second interface of the moving train. ISO/TS 13499 has no word for what is between two vehicles; a main location
that begins with 2 is a laboratory's own. Values are in SI.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from trainmj.collision.chain import Chain, n_own_sides, order_of_vehicles, places_of_sides
from trainmj.collision.deceleration import FILTER_INTERVAL, cfc60
from trainmj.collision.envelope import Array
from trainmj.collision.result import HISTORIES, Result
from trainmj.collision.summary import Summary
from trainmj.errors import InputError
from trainmj.exchange.tables import validity
from trainmj.files.folder import filling, staged
from trainmj.files.mme import CHANNELS, Channel, texts
from trainmj.files.written import remove, write_bytes

_MOST_NUMBER = 99  # of a vehicle or interface in a code
_UNFILTERED, _CFC60 = "0", "D"
_SIGN = "X is the direction in which the moving train travels"
_UNITS = {"m/s2": "m/(s*s)"}
_OF_VEHICLES = {"position": "DS", "velocity": "VE", "acceleration": "AC"}
_OF_INTERFACES = {"stroke": "DS", "force": "FO", "energy": "EN"}
"""Physical dimensions of the histories that are written."""


def write(result: Result, summary: Summary, out: Path, inputs: Iterable[Path] = ()) -> None:
    """Write a folder, ``NAME.mme`` and ``Channel/``, where NAME is that of the folder.

    Channels end where a result is no longer valid.

    Raises:
        InputError: if there is too much of it for the format.
        OutputError: if it cannot be written.
    """
    name = re.sub(r"[^A-Za-z0-9_-]", "_", out.resolve().name) or "trainmj"
    files = texts(name, _about(result, summary), list(_channels(result)))
    head = f"{name}.mme"
    of_channels = rf"{re.escape(name)}\.(chn|\d{{3}})"
    with filling(out, re.escape(head), inputs), filling(out / CHANNELS, of_channels, inputs):
        with staged(out / CHANNELS, of_channels, f"{name}.chn") as stage:
            for file, content in files.items():
                if file != head:
                    (stage / Path(file).name).write_bytes(content)
            remove(out / head)  # where it is, the channels belong to it
        write_bytes(out / head, files[head])


def _about(result: Result, summary: Summary) -> dict[str, str]:
    """What was tested."""
    chain, scenario = result.chain, result.scenario
    sides = [("moving train", 0, chain.n_moving), ("partner", chain.n_moving, len(chain.vehicles))]
    there = [(said, slice(first, end)) for said, first, end in sides if end > first]
    objects: dict[str, str] = {}
    for n, (said, of) in enumerate(there, start=1):
        train = scenario.collision.train if n == 1 else scenario.collision.partner
        objects |= {
            f"Name of test object {n}": f"{train} ({said})",
            f"Velocity test object {n}": f"{chain.speed[of][0]:.9g}",
            f"Mass test object {n}": f"{chain.mass[of].sum():.9g}",
        }
    valid = f"{validity(summary)}{': channels end there' * bool(summary.not_valid)}"
    return {
        "Laboratory name": f"trainmj {result.versions.get('trainmj', '')}",
        "Title": f"{scenario.heading}: {scenario.subject}",
        "Type of the test": "simulation of a train collision",
        "Subtype of the test": "",
        "Regulation": "",
        "Date of the test": "",
        "Number of test objects": str(len(there)),
        **objects,
        "Comments": f"status: {summary.status}; {valid}; {_SIGN}; compression is positive",
    }


def _channels(result: Result) -> Iterator[Channel]:
    chain = result.chain
    n = int(np.sum(result.time <= result.tally.valid_until))
    if n < 2:
        raise InputError("has fewer than two valid records, too few for channels")
    time, cut = result.time[:n], not result.tally.over or n < len(result.time)
    for i in order_of_vehicles(chain):
        moving = i < chain.n_moving
        number = chain.n_moving - i if moving else i - chain.n_moving + 1
        place, name = f"{_object(moving)}VEHC{_number(number)}CG00", chain.vehicles[i].name
        for history, dimension in _OF_VEHICLES.items():
            values = getattr(result, history)[:n, i]
            yield _channel(place, dimension, history, name, time, values, _UNFILTERED)
        if chain.record_interval <= FILTER_INTERVAL:
            first, filtered = cfc60(chain.record_interval, result.velocity[:n, [i]], cut)
            if filtered.shape[1] > 1:
                instants = np.asarray(first + chain.record_interval * np.arange(filtered.shape[1]))
                yield _channel(place, "AC", "acceleration", name, instants, filtered[0], _CFC60)
    for (k, side), moving, number in _places(chain):
        interface = chain.interfaces[k]
        name = interface.sides[side] if side < len(interface.sides) else f"{interface.name} partner"
        place = f"{_object(moving)}2IFC{_number(number)}0000"
        for history, dimension in _OF_INTERFACES.items():
            values = result.force[:, k] if history == "force" else result.of_device(history, k, side)
            yield _channel(place, dimension, history, name, time, values[:n], _UNFILTERED)


def _places(chain: Chain) -> Iterator[tuple[tuple[int, int], bool, int]]:
    """Interface and side, whether it is of the moving train, and its number there; both sides of the front."""
    places = places_of_sides(chain)
    own = n_own_sides(chain)
    partner = places[own:]
    if chain.interfaces[chain.front].equal_sides:
        partner = [(chain.front, 1), *partner]
    for moving, some in ((True, places[:own]), (False, partner)):
        for number, place in enumerate(some, start=1):
            yield place, moving, number


def _object(moving: bool) -> str:
    """Test object and position of a code."""
    return "10" if moving else "20"


def _number(number: int) -> str:
    if number > _MOST_NUMBER:
        raise InputError(f"has more than {_MOST_NUMBER} vehicles in a train, which ISO-MME cannot number: write csv")
    return f"{number:02}"


def _channel(place: str, dimension: str, history: str, name: str, time: Array, values: Array, filtered: str) -> Channel:
    """A channel; its laboratory code is the name that it has in histories.csv and in compare, without the unit."""
    cfc, unit = filtered == _CFC60, HISTORIES[history].unit
    own = f"{history}{'_cfc60' * cfc}_{name.replace(' ', '_')}"
    words = f"{history} of {name}{', CFC 60' * cfc}"
    more = {
        "Pre-filter type": "",
        "Channel frequency class": "60" if cfc else "",
        "Reference system": "global",
        "Comments": f"{_SIGN}; {'filtered after SAE J211' if cfc else 'not filtered'}",
    }
    return Channel(f"{place}{dimension}X{filtered}", words, _UNITS.get(unit, unit), time, values, own, more)
