"""The standard collision of Liu et al. 2022 over the empty stroke D, compared with Table 5 of the paper.

Run it with `python examples/paper_case/compare.py`. It computes nine collisions of the six-car B-type train (33 t a
vehicle, 25 km/h into a standing twin) and prints TS and TAMA as computed and as published.
"""

import pandas as pd

import trainmj
from trainmj.paper.printed import published

printed = published("table5_criteria_vs_D")
cases = pd.DataFrame({"empty_stroke_mm": printed["D_mm"].astype(float), "mass_t": 33.0})
computed = trainmj.run_cases(trainmj.load("b_type"), cases)

table = pd.DataFrame(
    {
        "D_mm": printed["D_mm"],
        "TS_mm": computed["TS_mm"].round(1),
        "TS_published_mm": printed["TS_mm"],
        "TS_deviation_percent": (100 * (computed["TS_mm"] / printed["TS_mm"] - 1)).round(2),
        "TAMA_g": computed["TAMA_g"].round(4),
        "TAMA_published_g": printed["TAMA_g"],
    }
)
print(table.to_string(index=False))
print(f"\nlargest deviation of TS: {table['TS_deviation_percent'].abs().max():.2f} %")
