"""Defects of Sections 7 and 8, Tables 10 to 13 and Eqs (7) to (18), from the printed numbers alone."""

from __future__ import annotations

import numpy as np
from scipy import stats

from trainmj.collision.envelope import Array
from trainmj.doe import accuracy, entropy_weights, parse_terms
from trainmj.doe.terms import columns
from trainmj.paper.analysis import CRITERIA, SPACE, TERMS, analyse, from_table_9, points_of
from trainmj.paper.finding import Defects, Shown
from trainmj.paper.printed import LIMIT_ANTI_CLIMBER_MM, change, number, numbers, published, split_unit

ORIGINAL_EMPTY_STROKE_MM = 22.0
"""Empty travel of the train as Section 2 describes it."""


defects_of_study = Defects()


@defects_of_study(
    "D's correlations mirror those of M: the ten points are not balanced",
    "Tables 9, 10; Section 7 against Section 5.3",
)
def _factors_correlated() -> Shown:
    nine = published("9")
    D, M = points_of(nine).T
    both = float(np.corrcoef(D, M)[0, 1])
    TAMA = nine["TAMA_g"].to_numpy()
    r, r_M = float(np.corrcoef(D, TAMA)[0, 1]), float(np.corrcoef(M, TAMA)[0, 1])
    partial = (r - both * r_M) / np.sqrt((1 - both**2) * (1 - r_M**2))
    over_D = change(published("5")["TAMA_g"])
    return (
        r > 0 > over_D and abs(both) > 0.3,
        f"Over the ten points D and M are correlated themselves, r = {both:.3f}. A response that depends on M "
        f"alone, with r = {r_M:.3f}, would show r = {both * r_M:+.3f} with D: Table 10 has {r:+.3f} for TAMA.",
        f"With M held constant (partial correlation) it is {partial:+.3f}. Section 7 reads the {r:+.3f} as TAMA "
        f"growing with D; Section 5.3 and Table 5 have it fall ({over_D:+.2f} %).",
    )


@defects_of_study(
    "Correlations with D are called strong, weak or positive that ten points cannot tell from none",
    "Table 10; Section 7; Abstract",
)
def _weak_and_strong() -> Shown:
    table = published("10").set_index("parameter").loc["D"]
    least = float(np.sqrt((t := stats.t.ppf(0.975, 8)) ** 2 / (8 + t**2)))
    return (
        bool((table.drop("stroke_m2_m3").abs() < least).all()),
        f"With ten points |r| must exceed {least:.3f} to differ from 0 at the 5 % level. Of D's coefficients only "
        f"M2-M3's ({table['stroke_m2_m3']}) does. {table['peak_acc_m2']} (M2) is called strong, {table['TS']} "
        "(TS) weak.",
        f"D is said to affect the first three interfaces significantly; for M1-M2 r is {table['stroke_m1_m2']}, "
        f"and Table 3 changes by {change(published('3')['stroke_m1_m2_mm']):+.2f} % amid scatter of that size.",
    )


@defects_of_study("One coefficient of Table 10 is cut off, not rounded", "Table 10")
def _cut_not_rounded() -> Shown:
    r = float(numbers(from_table_9().correlation.matrix(), "stroke_m2_m3")[0])
    printed = number("10", "D", "stroke_m2_m3")
    return (
        round(r, 3) != printed and np.trunc(r * 1000) / 1000 == printed,
        f"D with M2-M3 is {r:.5f}: {round(r, 3)} rounded, {printed} printed. The other 13 are rounded.",
    )


@defects_of_study("Eq. (7) cannot be used as printed: three decimals are too few", "Eq. (7)")
def _digits_of_eq_7() -> Shown:
    off = as_printed("TS_mm") / published("9")["TS_mm"].to_numpy() - 1
    fit = from_table_9().models["TS"]
    within = rounding_reach()
    coefficients = fit.coefficients().loc[list(TERMS)]
    return (
        off.max() < -0.01,
        f"At Table 9's ten points it gives TS {-100 * off.max():.1f} to {-100 * off.min():.1f} % too low: 0.0005 "
        f"in the coefficient of M3 alone is {0.0005 * 33**3:.0f} mm at 33 t.",
        f"Least squares on Table 9 gives {', '.join(f'{c:.7g}' for c in coefficients)} for {', '.join(TERMS)}. "
        f"Rounding TS to 0.01 mm moves the first by up to {within[0]:.0f}: the printed coefficients lie within "
        "that, and the fit gives the printed 1307.5 mm at the optimum.",
    )


@defects_of_study("Eq. (8) has lost its M2 term, and writes D2 as DM", "Eq. (8)")
def _lost_term_of_eq_8() -> Shown:
    wrong = as_printed("TAMA_g")
    fit = from_table_9().models["TAMA"].coefficients().loc[list(TERMS)]
    return (
        wrong.min() > 10 and abs(fit["M^2"]) > 0.01,
        f"As printed it gives {wrong.min():.0f} to {wrong.max():.0f} g at Table 9's points; the table has 1.27 to "
        "1.54 g. (Its 1.505e^-5 is read as 1.505 x 10^-5.)",
        f"Least squares on Table 9 gives {', '.join(f'{c:.4g}' for c in fit)} for {', '.join(TERMS)}: the M2 term "
        f"({fit['M^2']:.5f}) is missing, and 0.002 is D2's ({fit['D^2']:+.5f}) with the sign turned, not DM's "
        f"({fit['D*M']:+.5f}).",
    )


@defects_of_study(
    "Table 11 does not come from Eqs (9) to (11): it is cross-validation, over the range",
    "Table 11; Eqs (9) to (11)",
)
def _errors_of_table_11() -> Shown:
    a = from_table_9()

    def errors(name: str, head: str) -> str:
        y = numbers(a.responses, head)
        fitted, left = a.models[name].predict(points_of(a.responses)), a.models[name].leave_one_out()
        plain, ranged = accuracy(y, fitted), accuracy(y, left, over="range")
        denominator = 1 - ((left - y) ** 2).sum() / ((left - y.mean()) ** 2).sum()
        return (
            f"{name}: Eqs (9), (10) on the fit give ARE {100 * plain.are:.2f} % and RMSE {plain.rmse:.3g} "
            f"{split_unit(head)[1]}; each point left out in turn and divided by the range, {ranged.are:.4f} and "
            f"{ranged.rmse:.4f}; R2 {ranged.r2:.4f} with computed values in the denominator, {denominator:.4f} with "
            "predicted ones, as Eq. (11) prints it."
        )

    printed = published("11")
    rows = "; ".join(f"{r.criterion} {r.ARE}, {r.RMSE}, {r.R2}" for r in printed.itertuples())
    found = a.accuracies().round(3).to_numpy()
    return (
        (found == printed.drop(columns="criterion").to_numpy()).all(),
        errors("TS", "TS_mm"),
        errors("TAMA", "TAMA_g"),
        f"Table 11: {rows}.",
    )


@defects_of_study(
    "Table 12 comes from the raw data, not from the T-scores of Eqs (13) and (14)", "Table 12; Eqs (13) to (15)"
)
def _raw_data_of_table_12() -> Shown:
    nine = published("9")[list(CRITERIA.values())]
    raw = entropy_weights(nine, normalised=False)
    scores = entropy_weights(nine, normalised=False, transform="t_score")
    return (
        raw.weight[0] > 0.5 > scores.weight[0],
        f"Eq. (15) on Table 9 as it stands: entropies {raw.entropy[0]:.6f} and {raw.entropy[1]:.6f}, weights "
        f"{raw.weight[0]:.5f} and {raw.weight[1]:.5f}, as printed. With T-scores: {scores.entropy[0]:.4f} and "
        f"{scores.entropy[1]:.4f}, weights {scores.weight[0]:.5f} and {scores.weight[1]:.5f}: they change sides.",
    )


@defects_of_study(
    "The entropies are not scaled by 1/ln n, so the weights go to the wrong criterion",
    "Table 12; Eqs (16) to (18); Section 8.3",
)
def _weights_against_the_text() -> Shown:
    nine = published("9")[list(CRITERIA.values())]
    right = entropy_weights(nine)
    printed = published("12").set_index("criterion")
    e, w = printed["entropy"], printed["weight"]
    return (
        e["TAMA"] < e["TS"] and w["TAMA"] < w["TS"] and right.weight[1] > 0.5,
        f"An entropy over its largest value, ln 10 = {np.log(10):.6f}, is at most 1; Eq. (16) has no such factor, "
        f"so both differences 1 - e are negative ({', '.join(f'{g}' for g in printed['difference'])}).",
        f"Section 8.3: the more information, the smaller the entropy. TAMA has the smaller one ({e['TAMA']} "
        f"against {e['TS']}) and the smaller weight ({w['TAMA']} against {w['TS']}). With 1/ln n the weights are "
        f"TS {right.weight[0]:.3f}, TAMA {right.weight[1]:.3f}.",
    )


@defects_of_study(
    "How Table 13's optimum came out is not stated, and cannot be repeated", "Table 13; Eq. (12); Section 8.3"
)
def _optimum_not_stated() -> Shown:
    nine = published("9")
    by_order = (analyse(nine, 1), from_table_9(), analyse(nine, 3))
    chosen = [study.chosen for study in by_order]
    D, M = (number("13", "surrogate", head) for head in ("D_mm", "M_t"))
    strokes = [float(study.limits["anti_climber_mm"].predict([[D, M]])[0]) for study in by_order]
    return (
        all((d, round(m, 1)) != (D, M) for d, m in chosen),
        "Eq. (12) limits S_anti, for which the paper gives no surrogate, and the scaling of the weighted sum is "
        f"not given. Weighted sums run along the front to S_anti = {LIMIT_ANTI_CLIMBER_MM:g} mm: with "
        f"surrogates of S_anti of first, second and third order from Table 9 to "
        f"{', '.join(f'{d:g} mm and {m:g} t' for d, m in chosen)}.",
        f"At the printed optimum of {D:g} mm and {M:g} t they give S_anti "
        f"{', '.join(f'{s:.1f}' for s in strokes)} mm: the limit is not reached there, and heavier "
        "vehicles with a smaller TAMA were still allowed.",
    )


@defects_of_study(
    "'Significantly improved' is one criterion better by little, the other worse",
    "Abstract; Section 9; Tables 5, 13",
)
def _improvement() -> Shown:
    five = published("5")
    optimum = {h: number("13", "dynamics", h) for h in CRITERIA.values()}
    start, middle = (
        {h: float(np.interp(D, five["D_mm"], five[h])) for h in optimum} for D in (ORIGINAL_EMPTY_STROKE_MM, 35.0)
    )
    better, other = ({h: 100 * (optimum[h] / base[h] - 1) for h in optimum} for base in (start, middle))
    return (
        better["TAMA_g"] > 0 and other["TAMA_g"] > 0,
        f"From the train as described ({ORIGINAL_EMPTY_STROKE_MM:g} mm, 33 t; Table 5: {start['TS_mm']:.1f} mm, "
        f"{start['TAMA_g']:.4f} g) to Table 13's optimum ({optimum['TS_mm']} mm, {optimum['TAMA_g']} g): TS "
        f"{better['TS_mm']:+.2f} %, TAMA {better['TAMA_g']:+.2f} %. From 35 mm and 33 t: TS "
        f"{other['TS_mm']:+.2f} %, TAMA {other['TAMA_g']:+.2f} %.",
    )


def as_printed(head: str) -> Array:
    """Eq. (7) or (8) with its printed coefficients, at Table 9's points, (10,)."""
    table = published("Eqs")
    terms = parse_terms(table["term"].tolist(), SPACE.names)
    return np.asarray(columns(points_of(published("9")), terms) @ table[head].to_numpy(dtype=float))


def rounding_reach() -> Array:
    """How far the rounding of TS to 0.01 mm in Table 9 can move each coefficient of Eq. (7), (8,)."""
    basis = columns(points_of(published("9")), parse_terms(TERMS, SPACE.names))
    return np.asarray(0.005 * np.abs(np.linalg.pinv(basis, rcond=1e-17)).sum(axis=1))
