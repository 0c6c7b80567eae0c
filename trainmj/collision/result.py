"""What a collision leaves behind: histories at the recorded times, and a tally kept at every step."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from trainmj.collision.block import TALLY, Tally
from trainmj.collision.chain import Chain, name_of_side, order_of_vehicles, places_of_sides
from trainmj.collision.device import Array
from trainmj.collision.lineup import line_up
from trainmj.errors import InputError
from trainmj.files.arguments import given, path_given
from trainmj.files.text import printable
from trainmj.files.written import write_bytes
from trainmj.scenario import Scenario, from_yaml, to_yaml
from trainmj.units import KJ, KM_H, KN, MM, G, head

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

FILE = "result.nc"


class History(NamedTuple):
    """A quantity that is recorded over time."""

    over: str  # what it has a value for at each time: vehicle or interface
    unit: str  # of the recorded values
    meaning: str  # in words
    shown: str = ""  # unit in a spreadsheet; empty for a quantity that has no column there
    factor: float = 1.0  # by which values are divided to be in that unit


HISTORIES = {
    "position": History("vehicle", "m", "position, 0 where the two sides touch", "mm", MM),
    "velocity": History("vehicle", "m/s", "speed along +x", "km/h", KM_H),
    "acceleration": History("vehicle", "m/s2", "acceleration by all forces", "g", G),
    "stroke": History("interface", "m", "stroke", "mm", MM),
    "stroke_rate": History("interface", "m/s", "rate of the stroke"),
    "force": History("interface", "N", "force", "kN", KN),
    "energy": History("interface", "J", "absorbed energy, elastic energy not counted", "kJ", KJ),
}
"""What a result has over time, (n_sample, n_vehicle) or (n_sample, n_interface), by name."""


@dataclass(frozen=True, eq=False)
class Result:
    """One collision, computed.

    Attributes:
        scenario: what was collided.
        chain: the same as vehicles and interfaces in SI.
        tally: peaks, energies and impulses from every step.
        time: (n_sample,) recorded times [s].
        position: (n_sample, n_vehicle) [m], 0 where the two sides touch.
        velocity: (n_sample, n_vehicle) [m/s].
        acceleration: (n_sample, n_vehicle) of all forces [m/s2].
        stroke: (n_sample, n_interface) [m].
        stroke_rate: (n_sample, n_interface) [m/s].
        force: (n_sample, n_interface) [N].
        energy: (n_sample, n_interface) absorbed by the interface, elastic energy not counted [J].
        versions: of trainmj, MuJoCo and the rest that computed it, and the platform.
    """

    scenario: Scenario
    chain: Chain
    tally: Tally
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    stroke: Array
    stroke_rate: Array
    force: Array
    energy: Array
    versions: dict[str, str]

    @property
    def step_ms(self) -> float:
        """Step that it was computed with [ms]."""
        return self.scenario.simulation.step_ms

    def numbers(self) -> dict[str, Array]:
        """Every number of the result by name, histories and tally."""
        histories = {name: getattr(self, name) for name in ("time", *HISTORIES)}
        return histories | {f"tally_{t.name}": np.asarray(getattr(self.tally, t.name), dtype=np.float64) for t in TALLY}

    def dataset(self) -> xr.Dataset:
        """Everything as an xarray Dataset with named dimensions and units."""
        import xarray as xr

        histories = {
            name: (("time", h.over), getattr(self, name), {"units": h.unit, "long_name": h.meaning})
            for name, h in HISTORIES.items()
        }
        tally = {
            f"tally_{t.name}": (t.over, getattr(self.tally, t.name), {"units": t.unit, "long_name": t.meaning})
            for t in TALLY
        }
        return xr.Dataset(
            histories | tally,
            coords={
                "time": ("time", self.time, {"units": "s"}),
                "vehicle": [v.name for v in self.chain.vehicles],
                "interface": [i.name for i in self.chain.interfaces],
            },
            attrs={
                "title": self.scenario.heading,
                "scenario": to_yaml(self.scenario),
                "format": _FORMAT,
                "step_ms": self.step_ms,
                **{f"version_{name}": version for name, version in self.versions.items()},
            },
        )

    def save(self, file: str | Path) -> None:
        """Write everything to a NetCDF 4 file, which xarray, MATLAB and ncdump read.

        Raises:
            OutputError: if the file cannot be written.
        """
        # made in memory: HDF5 prints a page of tracebacks when the disk is full
        write_bytes(file, bytes(self.dataset().to_netcdf(engine="h5netcdf")))

    def table(self) -> pd.DataFrame:
        """Histories in engineering units, one row per recorded time, for a spreadsheet."""
        import pandas as pd

        columns: dict[str, Array] = {"time_s": self.time}
        for name, h in HISTORIES.items():
            for thing, values in (self.shown(name) if h.shown else {}).items():
                columns[head(f"{name}_{thing.replace(' ', '_')}", h.shown)] = values
        return pd.DataFrame(columns)

    def shown(self, name: str) -> dict[str, Array]:
        """A history as tables and figures show it: (n_sample,) values in its shown unit, by vehicle or interface.

        They come in the order of the tables. At the front, stroke and energy are those of one train's side: where the
        sides are not equal, the partner's are there too.
        """
        history, chain = HISTORIES[name], self.chain
        values: Array = getattr(self, name) / history.factor
        if history.over == "vehicle":
            return {chain.vehicles[i].name: values[:, i] for i in order_of_vehicles(chain)}
        found = {}
        for k, side in places_of_sides(chain):
            interface, column = chain.interfaces[k], values[:, k]
            if name == "stroke":
                column = interface.side_history(self.stroke[:, k], side) / history.factor
            elif name == "energy":
                largest = np.maximum.accumulate(np.maximum(self.stroke[:, k], 0.0))
                column = column * interface.energy_shares(largest)[side]
            found[name_of_side(interface, side)] = column
        return found


def find_result(file: str | Path) -> Path | None:
    """The result that a name leads to: a NetCDF file, or a folder that ``trainmj run --out`` left; None for others."""
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
        InputError: if the file is not there or not such a result.
    """
    import h5py
    import xarray as xr

    file = find_result(path_given(file)) or file
    if not Path(file).is_file():
        raise InputError(f"{file}: there is no such file")
    try:
        with h5py.File(file) as raw:
            raw.attrs.get("_nc3_strict")  # in h5netcdf's hands an error here would print a traceback
        with xr.open_dataset(file, engine="h5netcdf", decode_cf=False, phony_dims="access") as data:
            scenario, step_ms = _scenario_of(data, str(file))
            chain = line_up(scenario)
            _check_sizes(data, chain, str(file))
            data.load()
    except InputError:
        raise
    except _UNREADABLE as error:
        reason = printable(str(error)).splitlines() or [type(error).__name__]
        raise InputError(f"{file}: is not a readable NetCDF file ({reason[0][:200]})") from None
    if scenario.simulation.step_ms != step_ms:  # the default was another one
        scenario = scenario.with_values({"simulation.step_ms": step_ms})
        chain = line_up(scenario)
    tally: dict[str, Any] = {t.name: data[f"tally_{t.name}"].to_numpy() for t in TALLY}
    tally |= {t.name: tally[t.name].item() for t in TALLY if not t.over}
    tally["over"] = bool(tally["over"])
    versions = {
        k.removeprefix("version_"): printable(str(v)) for k, v in data.attrs.items() if k.startswith("version_")
    }
    histories: dict[str, Any] = {name: data[name].to_numpy() for name in HISTORIES}
    return Result(scenario, chain, Tally(**tally), data["time"].to_numpy(), **histories, versions=versions)


def _scenario_of(data: xr.Dataset, file: str) -> tuple[Scenario, float]:
    """The scenario in a file and the step it was computed with."""
    if data.attrs.get("format") != _FORMAT:
        raise InputError(
            f"{file}: is not a result of this trainmj (format {str(data.attrs.get('format'))[:60]!a}, not {_FORMAT!r})"
        )
    missing = {"time", *HISTORIES, *(f"tally_{t.name}" for t in TALLY)} - set(data.variables)
    if missing or "scenario" not in data.attrs:
        raise InputError(f"{file}: is not a whole result: {min(missing, default='scenario')} is missing")
    scenario = from_yaml(str(data.attrs["scenario"]), file)
    return scenario, float(data.attrs.get("step_ms", scenario.simulation.step_ms))


def _check_sizes(data: xr.Dataset, chain: Chain, file: str) -> None:
    """Refuse a file whose numbers are not those of its scenario, before they are read into memory."""
    sizes = {"vehicle": len(chain.vehicles), "interface": len(chain.interfaces)}
    n = int(data.sizes.get("time", 0))
    if not 0 < n <= chain.n_records:
        raise InputError(f"{file}: has {n} records and not 1 to {chain.n_records}, as its scenario would")
    over: dict[str, tuple[str, ...]] = {"time": ("time",)}
    over |= {name: ("time", h.over) for name, h in HISTORIES.items()}
    over |= {f"tally_{t.name}": t.over for t in TALLY}
    for name, dimensions in over.items():
        shape = tuple(n if d == "time" else sizes[d] for d in dimensions)
        if data[name].shape != shape or data[name].dtype.kind not in "fbiu":
            raise InputError(
                f"{file}: {name} is not {' x '.join(map(str, shape)) or 'one'} numbers as its scenario has"
            )


_UNREADABLE = (OSError, ValueError, KeyError, RuntimeError, TypeError, AttributeError, IndexError, MemoryError)
"""What the packages that read NetCDF raise on damaged files."""

_FORMAT = "trainmj result 1"
