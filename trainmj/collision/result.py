"""What a collision leaves behind: histories at the recorded times, and a tally kept at every step."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trainmj.collision.block import Car, Head, Joint, Layout
from trainmj.collision.chain import Chain, line_up
from trainmj.collision.device import Array
from trainmj.errors import InputError
from trainmj.files.atomic import write_bytes
from trainmj.files.text import printable
from trainmj.scenario import Scenario, from_yaml, to_yaml
from trainmj.units import KJ, KM_H, KN, MM, G

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

FILE = "result.nc"


@dataclass(frozen=True, eq=False)
class Tally:
    """What the device law counts at every step, as it stands at the end of a collision. SI.

    Vehicles are in the order of the chain, (n_vehicle,); interfaces likewise, (n_interface,).

    Attributes:
        time: of the last evaluation [s].
        over: whether the collision had come to its end.
        impulse: of rail friction and wall on all vehicles together [N s].
        speed: (n_vehicle,) at that time [m/s].
        friction_work: (n_vehicle,) done against rail friction [J].
        device_peak: (n_vehicle,) largest |acceleration| by the devices alone [m/s2].
        total_peak: (n_vehicle,) largest |acceleration|, rail friction included [m/s2].
        stroke: (n_interface,) at the last evaluation [m].
        plastic: (n_interface,) stroke at which the force would vanish: the permanent set [m].
        work: (n_interface,) done on the interface [J].
        dissipated: (n_interface,) by crushing and by the dashpot, added up from the law itself [J].
        stroke_max: (n_interface,) [m].
        stroke_max_time: (n_interface,) [s].
        force_max: (n_interface,) [N].
        first_force_time: (n_interface,) [s]; -1 where there was none.
        last_force_time: (n_interface,) [s].
    """

    time: float
    over: bool
    impulse: float
    speed: Array
    friction_work: Array
    device_peak: Array
    total_peak: Array
    stroke: Array
    plastic: Array
    work: Array
    dissipated: Array
    stroke_max: Array
    stroke_max_time: Array
    force_max: Array
    first_force_time: Array
    last_force_time: Array

    @classmethod
    def of(cls, layout: Layout, block: Array) -> Tally:
        """The tally in a simulation's block of user data."""
        car = {f: layout.car(block, f).copy() for f in Car}
        joint = {f: layout.joint(block, f).copy() for f in Joint}
        return cls(
            time=float(block[Head.TIME]),
            over=bool(block[Head.OVER]),
            impulse=float(block[Head.IMPULSE]),
            speed=car[Car.SPEED],
            friction_work=car[Car.FRICTION_WORK],
            device_peak=car[Car.DEVICE_PEAK],
            total_peak=car[Car.TOTAL_PEAK],
            stroke=joint[Joint.STROKE],
            plastic=joint[Joint.PLASTIC],
            work=joint[Joint.WORK],
            dissipated=joint[Joint.DISSIPATED],
            stroke_max=joint[Joint.STROKE_MAX],
            stroke_max_time=joint[Joint.STROKE_MAX_TIME],
            force_max=joint[Joint.FORCE_MAX],
            first_force_time=joint[Joint.FIRST],
            last_force_time=joint[Joint.LAST],
        )


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
        histories = {name: getattr(self, name) for name in ("time", *_HISTORIES)}
        return histories | {f"tally_{name}": np.asarray(getattr(self.tally, name), dtype=np.float64) for name in _TALLY}

    def dataset(self) -> xr.Dataset:
        """Everything as an xarray Dataset with named dimensions and units."""
        import xarray as xr

        histories = {
            name: (("time", over), getattr(self, name), {"units": unit}) for name, (over, unit) in _HISTORIES.items()
        }
        tally = {
            f"tally_{name}": (over, getattr(self.tally, name), {"units": unit}) for name, (over, unit) in _TALLY.items()
        }
        return xr.Dataset(
            histories | tally,
            coords={
                "time": ("time", self.time, {"units": "s"}),
                "vehicle": [v.name for v in self.chain.vehicles],
                "interface": [i.name for i in self.chain.interfaces],
            },
            attrs={
                "title": self.scenario.title or "train collision",
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

        things = {
            "vehicle": [v.name for v in self.chain.vehicles],
            "interface": [i.name for i in self.chain.interfaces],
        }
        columns: dict[str, Array] = {"time_s": self.time}
        for name, (over, unit, factor) in _COLUMNS.items():
            for k, thing in enumerate(things[over]):
                columns[f"{name}_{thing}_{unit}"] = getattr(self, name)[:, k] / factor
        return pd.DataFrame(columns)


def find_result(file: str | Path) -> Path | None:
    """The result that a name leads to: a NetCDF file, or a folder that ``trainmj run --out`` left; None for others."""
    path = Path(file)
    try:
        if path.suffix == ".nc" and path.is_file():
            return path
        return path / FILE if (path / FILE).is_file() else None
    except (OSError, ValueError):
        return None


def load_result(file: str | Path) -> Result:
    """Read a result that :meth:`Result.save` wrote.

    Raises:
        InputError: if the file is not there or not such a result.
    """
    import h5py
    import xarray as xr

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
    tally: dict[str, Any] = {name: data[f"tally_{name}"].to_numpy() for name in _TALLY}
    tally |= {name: tally[name].item() for name, (over, _) in _TALLY.items() if not over}
    tally["over"] = bool(tally["over"])
    versions = {
        k.removeprefix("version_"): printable(str(v)) for k, v in data.attrs.items() if k.startswith("version_")
    }
    histories: dict[str, Any] = {name: data[name].to_numpy() for name in _HISTORIES}
    return Result(scenario, chain, Tally(**tally), data["time"].to_numpy(), **histories, versions=versions)


def _scenario_of(data: xr.Dataset, file: str) -> tuple[Scenario, float]:
    """The scenario in a file and the step it was computed with."""
    if data.attrs.get("format") != _FORMAT:
        raise InputError(
            f"{file}: is not a result of this trainmj (format {str(data.attrs.get('format'))[:60]!a}, not {_FORMAT!r})"
        )
    missing = {"time", *_HISTORIES, *(f"tally_{name}" for name in _TALLY)} - set(data.variables)
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
    over |= {name: ("time", thing) for name, (thing, _) in _HISTORIES.items()}
    over |= {f"tally_{name}": things for name, (things, _) in _TALLY.items()}
    for name, dimensions in over.items():
        shape = tuple(n if d == "time" else sizes[d] for d in dimensions)
        if data[name].shape != shape or data[name].dtype.kind not in "fbiu":
            raise InputError(
                f"{file}: {name} is not {' x '.join(map(str, shape)) or 'one'} numbers as its scenario has"
            )


_UNREADABLE = (OSError, ValueError, KeyError, RuntimeError, TypeError, AttributeError, IndexError, MemoryError)
"""What the packages that read NetCDF raise on damaged files."""

_FORMAT = "trainmj result 1"
_HISTORIES = {
    "position": ("vehicle", "m"),
    "velocity": ("vehicle", "m/s"),
    "acceleration": ("vehicle", "m/s2"),
    "stroke": ("interface", "m"),
    "stroke_rate": ("interface", "m/s"),
    "force": ("interface", "N"),
    "energy": ("interface", "J"),
}
_TALLY: dict[str, tuple[tuple[str, ...], str]] = {
    "time": ((), "s"),
    "over": ((), "1"),
    "impulse": ((), "N s"),
    "speed": (("vehicle",), "m/s"),
    "friction_work": (("vehicle",), "J"),
    "device_peak": (("vehicle",), "m/s2"),
    "total_peak": (("vehicle",), "m/s2"),
    "stroke": (("interface",), "m"),
    "plastic": (("interface",), "m"),
    "work": (("interface",), "J"),
    "dissipated": (("interface",), "J"),
    "stroke_max": (("interface",), "m"),
    "stroke_max_time": (("interface",), "s"),
    "force_max": (("interface",), "N"),
    "first_force_time": (("interface",), "s"),
    "last_force_time": (("interface",), "s"),
}
_COLUMNS = {
    "position": ("vehicle", "mm", MM),
    "velocity": ("vehicle", "km_h", KM_H),
    "acceleration": ("vehicle", "g", G),
    "stroke": ("interface", "mm", MM),
    "force": ("interface", "kN", KN),
    "energy": ("interface", "kJ", KJ),
}
