"""Does this checkout compute the same numbers as another revision, to the last bit?

    python benchmarks/same_numbers.py REVISION [--keep FOLDER] [--only PART]

Both revisions run the same commands with the packages of this environment: every shipped scenario, two sweeps, two
studies, an identification and the paper. Compared are all numbers of result.nc and every CSV file. Columns that only
one of them has are listed; a number that differs, or a file that is missing, ends the script with exit code 1. With
--keep the results stay in a folder, and those of REVISION are taken from there the next time.
"""

from __future__ import annotations

import argparse
import io
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

ROOT = Path(__file__).resolve().parents[1]

TRAIN = """\
curves:
  buffer: { stroke_mm: [0, 10, 30, 60], force_kN: [0, 250, 460, 600] }
  tube: { stroke_mm: [60.5, 200, 201, 900], force_kN: [800, 800, 900, 900] }
devices:
  front: { curve: [buffer, tube], stiffness_kN_per_mm: 150, damping_kN_s_per_m: 20 }
  coupler: { curve: [buffer, { stroke_mm: [900], force_kN: [650] }], stiffness_kN_per_mm: 80, damping_kN_s_per_m: 200 }
trains:
  t: { vehicles: 3, mass_t: 30, front: front, coupler: coupler }
collision: { train: t, speed_km_h: 20, partner: t }
simulation: { step_ms: 0.5, time_limit_s: 0.6 }
"""

TARGETS = """\
scenario: train.yaml
parameters:
  k: { sets: devices.coupler.stiffness_kN_per_mm, bounds: [20, 400], scale: log, start: 200 }
  tube: { sets: [curves.tube.force_kN.0, curves.tube.force_kN.1], bounds: [650, 890], start: 700 }
  f10: { sets: curves.buffer.force_kN.1, bounds: [100, 400], start: 150 }
  f30: { sets: curves.buffer.force_kN.2, bounds: [150, 600], start: 500, above: f10 }
constraints:
  energy: { of: curves.buffer, to_mm: 60, area_kJ: 24.25, by: f30 }
targets:
  a2: { response: peak_device_M2_g, tolerance: 1 % }
  s1: { response: stroke_S1_M1_mm, tolerance: 1 % }
  both: { response: TS_mm - stroke_S1_M1_mm, tolerance: 1 % }
data:
  tests:
    rows:
      - { V: 20, a2: 0.9, s1: 190, both: 120 }
      - { V: 16, a2: 0.8, s1: 110, both: 105 }
    cases: { V: collision.speed_km_h }
    values: { a2: a2, s1: s1, both: both }
held_out:
  check: { rows: [{ V: 18, s1: 150 }], cases: { V: collision.speed_km_h }, values: { s1: s1 } }
method: { seed: 1, explore: { trials: 60 }, refine: { iterations: 6 } }
"""

SWEEP = """\
scenario: train.yaml
vary: { collision.speed_km_h: { from: 10, to: 25, count: 3 } }
sample:
  count: 4
  seed: 2
  method: sobol
  factors: { trains.t.mass_t: { uniform: [20, 40] }, devices.front.damping_kN_s_per_m: { choice: [0, 20] } }
"""


def commands(tree: Path) -> dict[str, list[str]]:
    """Every command by the folder that it writes."""
    names = sorted(p.stem for p in (tree / "scenarios").glob("*.yaml") if "." not in p.stem)
    runs = {f"run_{name}": ["run", name, "--figures", "none"] for name in names}
    grid = ["--vary", "empty_stroke_mm=20,35,50", "--vary", "mass_t=30,33", "--vary", "collision.speed_km_h=15,30"]
    return runs | {
        "sweep": ["sweep", "b_type", *grid],
        "sweep_of_file": ["sweep", "sweep.yaml"],
        "study_b_type": ["study", "b_type", "--figures", "none"],
        "study_tram": ["study", str(tree / "examples" / "study" / "plateaus.study.yaml"), "--figures", "none"],
        "identify": ["identify", "targets.yaml", "--figures", "none"],
        "paper": ["paper", "--figures", "none"],
    }


def compute(tree: Path, out: Path, only: str) -> None:
    """Run the commands of a checkout; what is there already is kept."""
    out.mkdir(parents=True, exist_ok=True)
    for name, text in (("train", TRAIN), ("targets", TARGETS), ("sweep", SWEEP)):
        (out / f"{name}.yaml").write_text(text)
    environment = os.environ | {"PYTHONPATH": str(tree), "PYTHONSAFEPATH": "1"}
    for name, words in commands(tree).items():
        if name.startswith(only) and not (out / name).exists():
            command = [sys.executable, "-m", "trainmj", *words, "--out", f"{name}.part"]
            done = subprocess.run(command, cwd=out, env=environment, capture_output=True, text=True, check=False)
            if done.returncode not in (0, 1) or "Traceback" in done.stderr:
                raise SystemExit(f"{name}: {' '.join(command)} ended with {done.returncode}\n{done.stderr}")
            (out / f"{name}.part").rename(out / name)


def differences(one: Path, two: Path, only: str) -> Iterator[tuple[bool, str]]:
    """What differs between two folders of results: whether it is a number, and in words."""
    files = {p.relative_to(folder) for folder in (one, two) for p in folder.glob(f"{only}*/*")}
    for file in sorted(f for f in files if f.suffix in (".nc", ".csv")):
        if not ((one / file).exists() and (two / file).exists()):
            yield True, f"{file}: only {'before' if (one / file).exists() else 'now'}"
            continue
        read = _arrays if file.suffix == ".nc" else _columns
        before, now = read(one / file), read(two / file)
        for which, names in (("before", before.keys() - now.keys()), ("now", now.keys() - before.keys())):
            if names:
                yield False, f"{file}: only {which}: {', '.join(sorted(names))}"
        for name in sorted(before.keys() & now.keys()):
            if said := _difference(before[name], now[name]):
                yield True, f"{file}: {name}: {said}"
        if [n for n in before if n in now] != [n for n in now if n in before]:
            yield False, f"{file}: the columns stand in another order"


def _difference(before: np.ndarray, now: np.ndarray) -> str:
    """What differs between two arrays of numbers or of words; nothing if they are the same to the last bit."""
    if before.shape != now.shape:
        return f"shape {before.shape} before, {now.shape} now"
    if before.tobytes() == now.tobytes():
        return ""
    try:
        apart = np.abs(before.astype(float) - now.astype(float))
    except ValueError:
        return f"differs, first '{before[before != now][0]}' before, '{now[before != now][0]}' now"
    return f"differs by at most {np.nanmax(apart):.2g}, of at most {np.nanmax(np.abs(before.astype(float))):.4g}"


def _arrays(file: Path) -> dict[str, np.ndarray]:
    with xr.open_dataset(file, decode_cf=False) as data:
        return {str(name): data[name].to_numpy().astype(np.float64) for name in data.data_vars}


def _columns(file: Path) -> dict[str, np.ndarray]:
    table = pd.read_csv(file, dtype=str, keep_default_na=False)
    return {str(name): table[name].to_numpy().astype(str) for name in table}


def main() -> None:
    """Compute both and compare."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("revision", help="such as v0.1.0 or a commit")
    parser.add_argument("--keep", type=Path, help="folder in which the results stay")
    parser.add_argument("--only", default="", help="commands that begin so: run, sweep, study, identify, paper")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        out = given.keep.resolve() if given.keep else Path(scratch)
        archive = subprocess.run(["git", "archive", given.revision], cwd=ROOT, capture_output=True, check=True).stdout
        with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
            tar.extractall(Path(scratch) / "before", filter="data")
        compute(Path(scratch) / "before", out / "before", given.only)
        with tempfile.TemporaryDirectory() as now:
            compute(ROOT, Path(now), given.only)
            found = list(differences(out / "before", Path(now), given.only))
    for _, said in found:
        print(said)
    wrong = sum(number for number, _ in found)
    print(f"{wrong} differ" if wrong else "Every number that both have is the same, bit for bit.")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
