"""Defects of Tables 3 to 9, and of what the text says about them, from the printed numbers alone."""

from __future__ import annotations

import numpy as np
import pandas as pd

from trainmj.collision.envelope import Array
from trainmj.paper.finding import Defects, Shown
from trainmj.paper.floors import left_by_quadratic
from trainmj.paper.printed import (
    EMPTY_STROKE_MM,
    ENERGIES,
    LIMIT_ANTI_CLIMBER_MM,
    MASS_T,
    SPEED_KM_H,
    STROKES,
    change,
    number,
    numbers,
    published,
    rms,
)
from trainmj.units import KM_H, G

defects_of_tables = Defects()


@defects_of_tables("Table 8's TAMA is not the mean of Table 7's peak accelerations", "Tables 5, 7, 8; Eq. (2)")
def _two_values_of_tama() -> Shown:
    d, m = published("5"), published("8")
    first, second = d[d["D_mm"] == 35].iloc[0], m[m["M_t"] == MASS_T].iloc[0]
    mean = _mean_peak(published("7"))
    off = mean - m["TAMA_g"].to_numpy()
    off_5 = np.abs(_mean_peak(published("4")) - d["TAMA_g"].to_numpy())
    k = int(np.flatnonzero(m["M_t"] == MASS_T)[0])
    return (
        first["TS_mm"] == second["TS_mm"] and off.min() > 0.01 and off_5.max() < 1e-4,
        f"35 mm and {MASS_T:g} t is one case: its TS is {first['TS_mm']} mm in Table 5 and {second['TS_mm']} mm in "
        f"Table 8, its TAMA {first['TAMA_g']} g and {second['TAMA_g']} g.",
        f"The mean of Table 7's row is {mean[k]:.4f} g. Over the nine rows Table 8 is {off.min():.4f} to "
        f"{off.max():.4f} g lower than the mean; Table 5 is the mean of Table 4 within {off_5.max():.5f} g.",
    )


@defects_of_tables("Table 9's peak accelerations come from other forces than those of Tables 4 and 7", "Tables 4, 7, 9")
def _accelerations_of_table_9() -> Shown:
    force, other = (_force(published(table), "peak_acc_m1_g") for table in "79")
    return (
        np.ptp(force) < 0.1 and other.min() > force.max() + 50,
        f"Mass times the peak acceleration of M1 is {force.min():.2f} to {force.max():.2f} kN in Table 7, one "
        f"force whatever the mass; in Table 9 it is {other.min():.0f} to {other.max():.0f} kN.",
        "Table 9's strokes and TS agree with the other tables. Table 10's last columns, Eq. (8) and Table 13's "
        "TAMA follow the accelerations.",
    )


@defects_of_tables(
    "M2's peak acceleration depends on D in Table 9, and does not in Table 4",
    "Tables 4, 9, 10; Section 5.2 against Section 7",
)
def _acceleration_of_m2_in_table_9() -> Shown:
    four, nine = published("4")["peak_acc_m2_g"], published("9")
    force = _force(nine, "peak_acc_m2_g")
    below = nine["D_mm"].to_numpy() <= 33
    low, high = force[below], force[~below]
    r = float(np.corrcoef(nine["D_mm"], force)[0, 1])
    same = float(np.ptp(four))
    return (
        same == 0.0 and high.min() > low.max(),
        f"Table 4 has {four.iloc[0]} g for every D (range {same:g} g). In Table 9 mass times M2's "
        f"peak is {low.min():.0f} to {low.max():.0f} kN for D up to 33 mm and {high.min():.0f} to "
        f"{high.max():.0f} kN from 37 mm on (r = {r:.2f}).",
        "Section 7 calls M2's peak acceleration strongly correlated with D (0.554), Section 5.2 unchanged.",
    )


@defects_of_tables(
    "TAMA has three levels, and Table 13's error of TAMA is the step between two of them",
    "Tables 5, 8, 9, 13; Section 8.3",
)
def _levels_of_tama() -> Shown:
    levels = {n: _force(published(n), "TAMA_g") for n in "589"}
    said = "; ".join(f"Table {n} {force.min():.0f} to {force.max():.0f} kN" for n, force in levels.items())
    surrogate, simulated = _force(published("13"), "TAMA_g")
    error = number("table13_relative_errors", "TAMA", "relative_error_percent")
    offset = 100 * (levels["9"].mean() / levels["5"].mean() - 1)
    return (
        levels["8"].max() < levels["5"].min() and levels["5"].max() < levels["9"].min(),
        f"Mass times TAMA, nearly one force whatever D and M: {said}. Table 13: surrogate {surrogate:.0f} kN, "
        f"collision dynamics {simulated:.0f} kN.",
        f"The surrogate was fitted to Table 9, which lies {offset:.1f} % above Table 5; the {error} % of Table 13 "
        "is that step. It neither measures the surrogate nor, as Section 8.3 has it, validates the dynamics model.",
    )


@defects_of_tables(
    "Strokes scatter from row to row by as much as the law that they are to show",
    "Tables 3, 6; the words 'not strictly monotonous' of Sections 5.1 and 6.1",
)
def _scatter() -> Shown:
    six = published("6")
    M = six["M_t"].to_numpy()
    strokes = {"S12": "stroke_m1_m2_mm", "S23": "stroke_m2_m3_mm", "S_anti": "anti_climber_mm"}
    left = {name: rms(_residual(M, six[head].to_numpy())) for name, head in strokes.items()}
    steps = np.diff(six["stroke_m1_m2_mm"].to_numpy())
    three = published("3")["stroke_m1_m2_mm"].to_numpy()
    half = 0.25 * 6 * M * (SPEED_KM_H * KM_H) ** 2 / 2  # kJ with M in t
    rest = half - six.filter(like="energy_").sum(axis=1).to_numpy()
    return (
        left["S12"] > 3 and (np.diff(three) < -3).any(),
        f"From row to row of Table 6 S12 changes by {', '.join(f'{s:+.1f}' for s in steps)} mm for equal steps "
        f"of mass. Rms off a parabola through them: {', '.join(f'{n} {r:.1f} mm' for n, r in left.items())}.",
        f"In Table 3 S12 changes by {three[-1] - three[0]:+.1f} mm in all, and by up to "
        f"{np.abs(np.diff(three)).max():.1f} mm between two rows.",
        "Half of the kinetic energy in the centre-of-mass frame, less the energies of the first three interfaces, "
        f"leaves {', '.join(f'{r:.1f}' for r in rest)} kJ for the rest of the train over Table 6, though the "
        "strokes of that rest stay the same within 0.5 mm.",
    )


@defects_of_tables("The scatter belongs to the mass: something else in the model changed with it", "Tables 5, 7, 8, 9")
def _scatter_of_the_mass_alone() -> Shown:
    five = published("5").assign(M_t=MASS_T)
    eight = published("8").assign(D_mm=EMPTY_STROKE_MM)
    eight = eight[eight["M_t"] != MASS_T]  # in Table 5 already
    tables = (five, eight, published("9"))
    D, M, TS = (np.concatenate([table[head].to_numpy() for table in tables]) for head in ("D_mm", "M_t", "TS_mm"))
    slope = float(np.polyfit(five["D_mm"], five["TS_mm"], 1)[0])
    left = _residual(M, TS - slope * (D - EMPTY_STROKE_MM))
    alike = {m: left[m == M] for m in np.unique(M)}
    mean = {m: float(rows.mean()) for m, rows in alike.items()}
    within = max(float(np.abs(rows - mean[m]).max()) for m, rows in alike.items())
    again = sum(rows.size for rows in alike.values() if rows.size > 1)
    low, high = mean[35.25], mean[35.0]
    cases = np.stack([D, M], axis=1)
    least = left_by_quadratic("largest", cases, TS, TS)
    between = rms(np.array(list(mean.values())))
    seven = published("7")
    force = _force(seven, "peak_acc_m4_g")
    a, b = (float(force[seven["M_t"].to_numpy() == m][0]) for m in (34.5, 35.25))
    peaks = pd.concat([published("4").assign(M_t=MASS_T), seven.assign(D_mm=EMPTY_STROKE_MM)])
    m4 = numbers(peaks, "peak_acc_m4_g")
    least_m4 = left_by_quadratic("largest", peaks[["D_mm", "M_t"]].to_numpy(), m4, m4, force=True)
    return (
        within < 1.0 and between > 4.0 and high - low > 15.0 and a / b > 1.02,
        f"TS brought to an empty stroke of {EMPTY_STROKE_MM:g} mm along Table 5's slope of {slope:.3f} mm per mm, "
        f"less a parabola over the mass: {again} collisions share their mass with another, in one table or in "
        f"another one, and agree with it within {within:.1f} mm. Different masses scatter by {between:.1f} mm "
        "rms.",
        f"At 35 t TS is {high:+.1f} mm off, twice; at 35.25 t {low:+.1f} mm: along this trend a model misses one of "
        f"the two by {(high - low) / 2:.1f} mm, {(high - low) / 2 / TS[np.equal(M, 35.25)][0]:.2%}. The quadratic in D "
        f"and M whose largest deviation is least, whatever its slope there, leaves {least:.2%} of one TS of Tables 5, "
        "8 and 9.",
        f"Mass times the peak acceleration of M4 in Table 7 falls from {a:.1f} to {b:.1f} kN between 34.5 and "
        f"35.25 t, {a / b - 1:.2%}: a force that stays the same misses one of them by {(a / b - 1) / 2:.2%}. The "
        f"quadratic in D and M whose largest deviation is least leaves {least_m4:.2%} of one peak.",
    )


@defects_of_tables(
    f"Tables 3, 6 and 9 exceed the {LIMIT_ANTI_CLIMBER_MM:g} mm that Eq. (12) allows the anti-climber",
    "Tables 3, 6, 9; Eq. (12)",
)
def _anti_climber_past_its_limit() -> Shown:
    rows = {n: published(n).query(f"anti_climber_mm > {LIMIT_ANTI_CLIMBER_MM}") for n in "369"}
    energy = [e for n in "36" for e in rows[n]["energy_s1_m1_kJ"] - 1.25 * rows[n]["anti_climber_mm"]]
    said = "; ".join(f"Table {n}: {', '.join(f'{v:g}' for v in t['anti_climber_mm'])} mm" for n, t in rows.items())
    return (
        not any(t.empty for t in rows.values()),
        f"Above the limit: {said}.",
        f"The energies go on at 1250 kN there: E_front - 1250 kN x S_anti stays {min(energy):.2f} to "
        f"{max(energy):.2f} kJ. The model has no stop at the limit.",
    )


@defects_of_tables("S1-M1 is said not to be strictly monotonous in D and M, and is", "Sections 5.1, 6.1; Tables 3, 6")
def _said_of_monotony() -> Shown:
    least = min(np.diff(published(n)["anti_climber_mm"]).min() for n in "36")
    other = np.diff(published("6")["stroke_m2_m3_mm"])
    return (
        least > 0,
        f"The smallest step of S_anti from row to row is {least:+.2f} mm, in both tables upwards throughout. M1-M2 "
        f"goes up and down in both; M2-M3 falls throughout in Table 3 and goes down {int((other < 0).sum())} times "
        "in Table 6.",
    )


@defects_of_tables("M3's peak acceleration is said to change with D, and does not", "Sections 5.2, 5.3; Table 4")
def _said_of_m3() -> Shown:
    m3 = published("4")["peak_acc_m3_g"]
    return (
        np.ptp(m3) == 0.0,
        f"Table 4 has {m3.iloc[0]} g for M3 in all {len(m3)} rows (range {np.ptp(m3):g} g). Section 5.2 first says "
        "that M1 to M3 stay the same, then explains 'a slight change ... of vehicles M3 to M6'; Section 5.3 "
        "repeats it.",
    )


@defects_of_tables(
    "That M affects S1-M1 most in stroke and least in energy comes from leaving the coupler out",
    "Section 6.1; Table 6",
)
def _ranking_without_the_coupler() -> Shown:
    six = published("6")
    whole = change(six["coupler_mm"] + six["anti_climber_mm"])
    anti, s12, s23 = (change(six[head]) for head in STROKES)
    energy = [change(six[head]) for head in ENERGIES]
    return (
        anti > s23 > s12 > whole and energy[2] > energy[1] > energy[0],
        f"S_anti alone grows by {anti:.2f} % from 30 to 36 t, the stroke of the whole front device, coupler "
        f"included, by {whole:.2f} %; M1-M2 by {s12:.2f} %, M2-M3 by {s23:.2f} %.",
        "Counted whole, strokes rank as the energies do "
        f"({energy[0]:.2f}, {energy[1]:.2f}, {energy[2]:.2f} %): S1-M1 least, M2-M3 most.",
    )


@defects_of_tables("Peak accelerations are said to decrease linearly with M; they go as 1/M", "Section 6.2; Table 7")
def _linear_decrease() -> Shown:
    seven = published("7")
    M, a = numbers(seven, "M_t"), numbers(seven, "peak_acc_m1_g")
    inverse = a - np.mean(a * M) / M
    line = a - np.polyval(np.polyfit(M, a, 1), M)
    return (
        rms(inverse) * 10 < rms(line),
        f"M1: one number over M misses the nine values by {rms(inverse):.5f} g (rms), a straight line with two "
        f"numbers by {rms(line):.4f} g. From 30 to 36 t the change is {change(a):.2f} %, and "
        f"30/36 - 1 is {100 * (30 / 36 - 1):.2f} %.",
    )


def _force(table: pd.DataFrame, head: str) -> Array:
    """Mass times acceleration [kN] of each row, at 33 t where the table does not vary the mass."""
    mass = numbers(table, "M_t") if "M_t" in table else MASS_T
    return np.asarray(mass * numbers(table, head) * G)


def _mean_peak(table: pd.DataFrame) -> Array:
    """Mean over the vehicles of each row, Eq. (2)."""
    return np.asarray(table.filter(like="peak_acc").mean(axis=1))


def _residual(x: Array, y: Array) -> Array:
    """What a parabola leaves, (n,)."""
    return np.asarray(y - np.polyval(np.polyfit(x, y, 2), x))
