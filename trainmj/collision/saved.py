"""Saved results: a file is read as a whole or not at all, whoever made it.

A checksum covers every byte. Nothing is decoded before all of it is known to be what the scenario in it has.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.collision.block import TALLY, Tally
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.fields import KEPT
from trainmj.collision.lineup import line_up
from trainmj.collision.result import FORMAT, HISTORIES, OF_PLANE, VERSION, Result, dimensions_of
from trainmj.errors import InputError
from trainmj.files.arguments import given, path_given
from trainmj.files.netcdf import Stored, unpacked
from trainmj.files.signed import is_intact
from trainmj.files.text import printable, read_bytes
from trainmj.files.yaml import MOST_BYTES
from trainmj.scenario import Scenario, from_yaml, shipped

FILE = "result.nc"

_MOST_BYTES = 300_000_000
"""More than the largest result that the limits of a scenario allow."""

_LONGEST_INTERVAL = 0.1
"""Between two records [s]."""

_NAMES = {"vehicle", "interface", "point", "member", "wheelset", "degree"}
"""Variables that say what there are values for; they follow from the scenario and are not read."""

_READ = {"scenario", "format", "step_ms", "refined"}
_LONGEST_TEXT = 10_000
"""Of an attribute, but for the scenario."""


def find_result(file: str | Path) -> Path | None:
    """The result that a name leads to where a scenario may stand, too; None for others.

    Raises:
        InputError: if it is the name of a folder with a result, and of a shipped scenario.
    """
    found = _saved_at(file)
    if found is not None and str(file) in shipped():
        raise InputError(
            f"{file}: is a folder with a result here, and the name of a shipped scenario: write {found} or {file}.yaml"
        )
    return found


def _saved_at(file: str | Path) -> Path | None:
    """The result at a path: a NetCDF file, or one in a folder that ``trainmj run --out`` left; None for others."""
    path = Path(file)
    try:
        if path.suffix == ".nc" and path.is_file():
            return path
        return path / FILE if (path / FILE).is_file() else None
    except (OSError, ValueError):
        return None


def result_given(result: Result | str | Path) -> Result:
    """A result, or the one that the path of a file or of the folder of a run leads to.

    Raises:
        InputError: if there is none that can be read.
        TypeError: if it is something else.
    """
    return given(result, Result, load_result)


def load_result(file: str | Path) -> Result:
    """Read a result that :meth:`Result.save` wrote, from its file or from the folder of a run.

    Raises:
        InputError: if the file is not there, is not such a result, or is not as it was written.
    """
    file = _saved_at(path_given(file)) or file
    if not Path(file).is_file():
        raise InputError(f"{file}: there is no such file")
    try:
        content = read_bytes(Path(file), _MOST_BYTES)
        attributes, variables = _unpacked(content)
        scenario, step_ms = _scenario_in(attributes, variables, str(file))
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(file)) else f"{file}: {text}") from None
    chain = line_up(scenario)
    numbers = _numbers_of(variables, chain, str(file))
    if scenario.simulation.step_ms != step_ms:  # the default was another one
        scenario = scenario.with_values({"simulation.step_ms": step_ms})
        chain = line_up(scenario)
    chain = replace(chain, refined=attributes.get("refined") == 1)
    if not chain.members:  # each vehicle is a point
        numbers |= {f"point_{name}": numbers[name] for name in ("position", "velocity", "acceleration")}
        numbers |= {"tally_point_speed": numbers["tally_speed"], "tally_point_peak": np.zeros(len(chain.vehicles))}
        numbers |= {f"tally_{t.name}": np.zeros(0) for t in TALLY if t.over == ("member",)}
        numbers["member_plastic"] = np.zeros((numbers["time"].size, 0))
    if not chain.plane:
        numbers |= {name: np.zeros((numbers["time"].size, 0)) for name, h in HISTORIES.items() if h.over in OF_PLANE}
        numbers |= {f"tally_{t.name}": np.zeros(0) for t in TALLY if set(t.over) & set(OF_PLANE)}
    tally: dict[str, Any] = {t.name: numbers[f"tally_{t.name}"] for t in TALLY}
    tally |= {t.name: tally[t.name].item() for t in TALLY if not t.over}
    tally["over"] = bool(tally["over"])
    versions = {
        printable(name.removeprefix(VERSION)): printable(str(text))
        for name, text in attributes.items()
        if name.startswith(VERSION)
    }
    histories = {name: numbers[name] for name in ("time", *HISTORIES)}
    result = Result(scenario, chain, Tally(**tally), **histories, versions=versions)
    _check_finite(result, str(file))
    return result


def _unpacked(content: bytes) -> tuple[dict[str, Any], dict[str, Stored]]:
    """Those attributes of a NetCDF 3 file that results have, and all its variables, not decoded, by name.

    Raises:
        InputError: if it is none, has no checksum, or is not as it was written.
    """
    if content.startswith(b"\x89HDF"):
        raise InputError("is an HDF5 file; results are NetCDF 3: compute it again from the scenario.yaml beside it")
    if not content.startswith(b"CDF"):
        raise InputError("is not a readable NetCDF file")
    try:
        intact = is_intact(content)
    except ValueError as error:
        raise InputError(f"is not a result of this trainmj: {error}") from None
    if not intact:
        raise InputError("is damaged, or was changed: its checksum is not that of its content")
    try:
        attributes, variables = unpacked(content)
        wanted = {name: stored for name, stored in attributes.items() if name in _READ or name.startswith(VERSION)}
        for name, stored in wanted.items():
            if math.prod(stored.shape) > (MOST_BYTES if name == "scenario" else _LONGEST_TEXT):
                raise ValueError(f"{name} is too long")
        return {name: stored.value() for name, stored in wanted.items()}, variables
    except ValueError as error:
        raise InputError(f"is not a readable NetCDF file ({error})") from None


def _scenario_in(attributes: Mapping[str, Any], variables: Mapping[str, Stored], file: str) -> tuple[Scenario, float]:
    """The scenario in a file and the step it was computed with."""
    if attributes.get("format") != FORMAT:
        said = ascii(str(attributes.get("format"))[:60])
        raise InputError(f"is not a result of this trainmj (format {said}, not {FORMAT!r})")
    for name in ("scenario", "time"):
        if name not in (attributes if name == "scenario" else variables):
            raise InputError(f"is not a whole result: {name} is missing")
    scenario = from_yaml(str(attributes["scenario"]), file)
    try:
        return scenario, float(attributes.get("step_ms", scenario.simulation.step_ms))
    except (TypeError, ValueError):
        raise InputError("is not a whole result: step_ms is no number") from None


def _numbers_of(variables: Mapping[str, Stored], chain: Chain, file: str) -> dict[str, Array]:
    """The numbers of a file by name: nothing is decoded before all of it is known to be what its scenario has.

    Raises:
        InputError: if something is missing, is of another size, or is there and belongs to no result of its scenario.
    """
    sizes = {
        "vehicle": len(chain.vehicles),
        "interface": len(chain.interfaces),
        "element": chain.n_places,
        "point": len(chain.points),
        "member": len(chain.members),
        "contact": KEPT,
        "frame": len(chain.vehicles),
        "ends": len(chain.interfaces),
        "wheelset": len(chain.wheelsets),
        "line": len(chain.lines),
        "degree": chain.first_dof[-1],
        "time": math.prod(variables["time"].shape),
    }
    if not 0 < sizes["time"] <= chain.n_records:
        raise InputError(f"{file}: has {sizes['time']} records and not 1 to {chain.n_records}, as its scenario would")
    dimensions = dimensions_of(chain)
    for name, over in dimensions.items():
        if name not in variables:
            raise InputError(f"{file}: is not a whole result: {name} is missing")
        shape = tuple(sizes[dimension] for dimension in over)
        if variables[name].shape != shape or not variables[name].is_number:
            raise InputError(
                f"{file}: {name} is not {' x '.join(map(str, shape)) or 'one'} numbers as its scenario has"
            )
    if more := sorted(variables.keys() - dimensions.keys() - _NAMES):
        raise InputError(
            f"{file}: has a variable {printable(more[0])!r}, which no result of its scenario has: compute it again"
        )
    try:
        numbers = {name: variables[name].values().astype(np.float64) for name in dimensions}
    except ValueError as error:
        raise InputError(f"{file}: is not a readable NetCDF file ({error})") from None
    time = numbers["time"]
    if not (time[0] == 0 and np.all(np.diff(time) > 0) and time[-1] <= chain.time_limit + _LONGEST_INTERVAL):
        raise InputError(f"{file}: time does not grow from 0 s to the time limit of its scenario")
    return numbers


def _check_finite(result: Result, file: str) -> None:
    """Refuse values that are not finite, but for a tally, less its counts, whose status says so: of an unstable run.

    Raises:
        InputError: with file, variable and place.
    """
    lost = {name: values for name, values in result.numbers().items() if not np.isfinite(values).all()}
    if not lost:
        return
    measures = {f"tally_{t.name}" for t in TALLY if t.unit != "1"}
    if lost.keys() <= measures:
        from trainmj.collision.ending import all_finite
        from trainmj.collision.measured import Measured

        measured = Measured.of_one(result.chain, result.tally, result.time, result.velocity)
        if not all_finite(measured).all():
            return
    name, values = next(iter(lost.items()))  # histories first
    at = np.argwhere(~np.isfinite(values))[0].tolist()
    where = ", ".join(f"{over} {n}" for over, n in zip(dimensions_of(result.chain)[name], at, strict=True))
    place = f" at {where}, counted from 0" if where else ""
    raise InputError(f"{file}: {name} is {values[tuple(at)]}{place}, and must be finite: compute it again")
