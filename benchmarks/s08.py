"""What else could be in the paper's model, beside its law S08 as documented? What each leaves of the printed scatter.

python benchmarks/s08.py [--quick] [--costs]

The train is ``b_type_s08``, its curves as they are shipped. Each variant has one line: a dashpot on the spring, a
spring before the rails slip (LS-DYNA's S03), curves resampled to 100 equally spaced points, speeds kept in single
precision, other windows of means. What is left of the strokes' scatter is that of :mod:`trainmj.paper.scatter`:
about a straight line over D, at 33 t, and about a parabola over M, at 35 mm.

The variants are simulated by a small integrator of this script, not by trainmj's engine, which has none of them but the
dashpot and the window; the first line is held against the engine's numbers. ``--costs`` measures what a collision costs
in the engine instead.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numba
import numpy as np
from laws import envelope
from numpy.polynomial import Polynomial
from others import crushed

import trainmj
from trainmj.collision.batch import run_chains
from trainmj.collision.chain import Chain
from trainmj.collision.lineup import line_up
from trainmj.paper.collisions import DOCUMENTED, SCENARIO, Case, cases_of, simulate
from trainmj.paper.printed import PEAKS, STROKES, numbers, published, rms
from trainmj.paper.tables import strokes_of
from trainmj.units import KN_PER_MM, KN_S_PER_M, MM, MS, G

UNTIL = 0.85
DOUBLE, SPEEDS, ALL = range(3)


@dataclass(frozen=True)
class Variant:
    """One model: S08 with something beside it."""

    words: str
    step: float = 2e-5
    damping: float = 0.0  # dashpot of all devices, up to the crush force [kN s/m]
    rail: float = np.inf  # stiffness of the rails before they slip [kN/mm]
    points: int = 0  # of each curve, equally spaced up to ...
    ends: tuple[float, float, float] = (np.inf,) * 3  # ... these strokes of front, A-B and C-D [mm]; its end by default
    single: int = DOUBLE  # what is kept in single precision: nothing, SPEEDS, or positions and strokes too
    window: float = 3.8  # of the means [ms]


@numba.njit(cache=True)
def collide(mass, speed, friction, share, of, strokes, forces, counts, K, c, rail, single, window, step, until):
    """Largest mean accelerations [m/s2] of M1 to M6 and largest strokes [m] of their six interfaces."""
    n = of.size + 1
    x, v, held = np.zeros((3, n))
    v[: n // 2] = speed
    plastic, top, force = np.zeros((3, n - 1))
    mean, impulse = np.zeros((2, n))
    limit = friction * mass * 9.80665
    for s in range(int(until / step)):
        for j in range(n - 1):
            t = of[j]
            u = (x[j] - x[j + 1]) * share[t]
            rate = (v[j] - v[j + 1]) * share[t]
            if single == 2:
                u = float(np.float32(u))
            elastic = K * (u - plastic[j])
            force[j] = 0.0
            if elastic > 0.0:
                crush = envelope(strokes[t], forces[t], counts[t], u)
                if elastic >= crush:
                    force[j] = crush
                    plastic[j] = u - crush / K
                else:
                    force[j] = min(crush, max(0.0, elastic + c * rate))
            top[j] = max(top[j], u)
        for i in range(n):
            net = (force[i - 1] if i > 0 else 0.0) - (force[i] if i + 1 < n else 0.0)
            if s % window == 0:
                mean[i] = max(mean[i], abs(impulse[i]) / (window * step * mass))
                impulse[i] = 0.0
            impulse[i] += net * step
            if np.isinf(rail):
                rails = min(limit, max(-limit, -(mass * v[i] / step + net)))
            else:  # a spring that slips
                held[i] = min(limit, max(-limit, held[i] - rail * v[i] * step))
                rails = held[i]
            v[i] += (net + rails) / mass * step
            if single >= 1:
                v[i] = float(np.float32(v[i]))
            x[i] += v[i] * step
            if single == 2:
                x[i] = float(np.float32(x[i]))
    out = np.empty((2, n // 2))
    out[0] = mean[: n // 2][::-1]
    out[1] = top[: n // 2][::-1]
    return out


@numba.njit(cache=True, parallel=True)
def collide_all(masses, speed, friction, share, of, strokes, forces, counts, K, c, rail, single, window, step, until):
    """(case, 2, 6) results of all cases."""
    out = np.empty((masses.size, 2, (of.size + 1) // 2))
    for k in numba.prange(masses.size):
        out[k] = collide(
            masses[k], speed, friction, share, of, strokes[k], forces[k], counts[k], K, c, rail, single, window, step,
            until,
        )  # fmt: skip
    return out


def curves(chain: Chain, variant: Variant, room: int = 2048) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(3, room) strokes [m] and forces [N] of front, A-B and C-D, and the number of points of each."""
    envelopes, _ = crushed(chain)
    strokes, forces, counts = np.zeros((3, room)), np.zeros((3, room)), np.zeros(3, dtype=int)
    for t, k in enumerate((chain.front, chain.front - 1, chain.front - 2)):
        u, f = envelopes[k].stroke, envelopes[k].force
        if variant.points:
            at = np.linspace(0.0, min(variant.ends[t] * MM, u[-2]), variant.points)  # the last point is the car body's
            u, f = at, np.interp(at, u, f)
        strokes[t, : u.size], forces[t, : u.size], counts[t] = u, f, u.size
    return strokes, forces, counts


def compute(variant: Variant, cases: list[Case]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Peaks of means (case, 6) [g], S_anti, S12, S23 (case, 3) [mm], TS (case,) [mm]."""
    scenario = trainmj.load(DOCUMENTED)
    chains = [line_up(scenario.with_values({"empty_stroke_mm": d, "mass_t": m})) for d, m in cases]
    strokes, forces, counts = map(np.array, zip(*(curves(chain, variant) for chain in chains), strict=True))
    of = np.array([1, 2, 2, 2, 1, 0, 1, 2, 2, 2, 1])
    K = scenario.devices["front"].stiffness_kN_per_mm
    window = round(variant.window * MS / variant.step)
    out = collide_all(
        np.array([m for _, m in cases]) * 1e3, 25 / 3.6, 0.008, np.array([0.5, 1.0, 1.0]), of, strokes, forces, counts,
        K * KN_PER_MM, variant.damping * KN_S_PER_M, variant.rail * KN_PER_MM, variant.single, window, variant.step,
        UNTIL,
    )  # fmt: skip
    top = out[:, 1] / MM
    empty = np.array([d for d, _ in cases])
    anti = np.maximum(0.0, top[:, 0] - 353 - empty)
    TS = np.minimum(top[:, 0], 353) + anti + top[:, 1:].sum(axis=1)
    return out[:, 0] / G, np.column_stack([anti, top[:, 1:3]]), TS


def left(x: np.ndarray, off: np.ndarray, power: int) -> np.ndarray:
    """Rms of what polynomials leave of columns (n, k)."""
    return np.array([rms(y - Polynomial.fit(x, y, power)(x)) for y in off.T])


HEAD = (
    f"{'left, mm; largest deviation of peaks and TS':52s}  over D: S_anti  S12   S23   over M: S_anti  S12   S23    TS"
    "   peaks  TS, 3-8   TS, 9      13"
)


def report(variant: Variant) -> str:
    """One line."""
    three, six, nine, four, seven = (published(number) for number in ("3", "6", "9", "4", "7"))
    cases = [*cases_of(three), *cases_of(six), *cases_of(nine), (50.0, 32.4)]
    peaks, strokes, TS = compute(variant, cases)
    printed = np.vstack([np.column_stack([numbers(table, head) for head in STROKES]) for table in (three, six)])
    TS_printed = np.concatenate([numbers(published(number), "TS_mm") for number in ("5", "8", "9")])
    over_D = left(numbers(three, "D_mm"), printed[:9] - strokes[:9], 1)
    off = np.column_stack([printed[9:] - strokes[9:18], TS_printed[9:18] - TS[9:18]])
    over_M = left(numbers(six, "M_t"), off, 2)
    wanted = np.vstack([np.column_stack([numbers(table, head) for head in PEAKS]) for table in (four, seven)])
    peak = 100 * np.abs(peaks[:18] / wanted - 1).max()
    fitted, held = (100 * np.abs(TS[at] / TS_printed[at] - 1).max() for at in (slice(18), slice(18, 28)))
    of_13 = 100 * abs(TS[28] / 1318.96 - 1)
    return (
        f"{variant.words:52s} {'':7s}{over_D[0]:6.2f} {over_D[1]:5.2f} {over_D[2]:5.2f} {'':8s}{over_M[0]:6.2f} "
        f"{over_M[1]:5.2f} {over_M[2]:5.2f} {over_M[3]:5.2f} {peak:6.2f}% {fitted:7.2f}% {held:6.2f}% {of_13:6.2f}%"
    )


def variants(quick: bool) -> Iterator[Variant]:
    """What is tried."""
    yield Variant("S08 as documented")
    for c in (10, 100, 300, 1000, 3000, 10_000):
        yield Variant(f"a dashpot of {c} kN s/m on the spring", damping=c)
    for k in (1e-3, 1e-2, 0.1, 1, 10, 100):
        yield Variant(f"rails as S03: {k:g} kN/mm before they slip", rail=k)
    limits = (353 + 50 + 265, 418, 418)
    for n in (100, 500, 2000):
        yield Variant(f"curves as {n} equal pieces, to their ends", points=n + 1)
        yield Variant(f"curves as {n} equal pieces, to the stroke limits", points=n + 1, ends=limits)
    for single, words in ((SPEEDS, "speeds"), (ALL, "speeds, positions, strokes")):
        for us in (20, 10, 5, 4, 3.5, 10 / 3, 3, 2.75, 2.5, 2.25, 2, 1.75, 1.5, 1.25, 1)[: 2 if quick else None]:
            yield Variant(f"{words} in single precision, {us:.3g} us", step=us * 1e-6, single=single)
    for step in (1e-5, 5e-6)[: 1 if quick else None]:
        yield Variant(f"S08 as documented, {step * 1e6:g} us", step=step)
    for window in (0.02, 1.0, 2.0, 3.0, 5.0, 6.0, 8.0, 10.0):
        yield Variant(f"means over {window:g} ms", window=window)


def against_the_engine() -> str:
    """How far this script is from trainmj in the 17 cases of Tables 3 to 8."""
    cases = list(dict.fromkeys([*cases_of(published("3")), *cases_of(published("6"))]))
    _, strokes, TS = compute(Variant("here"), cases)
    found = simulate(cases, scenario=DOCUMENTED)
    off = max(np.abs(strokes[k] - list(strokes_of(found[case]).values())).max() for k, case in enumerate(cases))
    total = max(abs(TS[k] - found[case].TS_mm) for k, case in enumerate(cases))
    return f"largest difference from trainmj: {off:.3f} mm in a stroke, {total:.3f} mm in TS"


def costs() -> Iterator[str]:
    """Collisions a second in the engine: each law at its own step, the least of three turns of 64, on one core."""
    for name in (SCENARIO, DOCUMENTED):
        scenario = trainmj.load(name)
        chains = {("D", d): line_up(scenario.with_values({"empty_stroke_mm": d})) for d in np.linspace(20, 50, 64)}
        plain = {key: replace(chain, steps_per_window=0) for key, chain in chains.items()}
        for words, these in ((f"{name}", chains), (f"{name}, without windows", plain)):
            times = []
            for _ in range(3):
                began = time.perf_counter()
                for _ in run_chains(these.items(), threads=1):
                    pass
                times.append(time.perf_counter() - began)
            a_second = len(these) / min(times)
            yield f"{words:32s} step {scenario.simulation.step_ms:g} ms: {a_second:6.1f} collisions a second"


def main() -> None:
    """Print one line for each variant, or the costs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="without the smallest steps")
    parser.add_argument("--costs", action="store_true", help="what a collision costs, instead")
    options = parser.parse_args()
    if options.costs:
        for line in costs():
            print(line, flush=True)
        return
    print(against_the_engine())
    print(HEAD)
    for variant in variants(options.quick):
        print(report(variant), flush=True)


if __name__ == "__main__":
    main()
