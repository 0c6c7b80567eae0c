"""How far off a number may be and still agree: every bar of the comparison with the paper, in this one place."""

from __future__ import annotations

PEAK_EACH = 0.0135
"""Tables 4 and 7: every peak acceleration, relative. A law that is smooth in the mass cannot come below 1.02 %: see
the defect of the scatter that belongs to the mass."""

PEAK_RMS_G = {"M1": 0.001, "M2": 0.006, "M3": 0.006, "M4": 0.006, "M5": 0.006, "M6": 0.006}
"""Tables 4 and 7: each vehicle's rms [g]."""

STROKE_RMS_MM = {"anti_climber_mm": 5.0, "stroke_m1_m2_mm": 8.0, "stroke_m2_m3_mm": 6.0}
"""Tables 3 and 6. The paper's own rows scatter by up to 8 mm (rms) about a smooth curve."""

STROKE_BIAS_MM = 3.0
"""Tables 3 and 6: mean deviation of each stroke."""

ENERGY_RMS = {"energy_s1_m1_kJ": 0.006, "energy_m1_m2_kJ": 0.028, "energy_m2_m3_kJ": 0.025}
"""Tables 3 and 6, relative."""

COUPLER_MM = 0.5
"""Tables 3 and 6: the coupler is used up in every case, 353 mm to the printed digit."""

TS_EACH = 0.0075
"""Tables 5 and 8, relative. Together with Table 9 a law that is smooth in the mass cannot come below 0.58 %."""

TAMA_EACH = 0.001
"""Table 5, relative."""

TAMA_OF_TABLE_7_EACH = 0.005
"""The means of Table 7's rows, which Table 8 should be, relative."""

TS_TABLE_9_EACH = 0.0075
"""Table 9, held out, relative."""

TS_TABLE_13 = 0.003
"""Table 13, held out, relative."""

TAMA_TABLE_13 = 0.008
"""Table 13, held out [g]."""

BALANCE_TIME_EACH = 0.02
"""Balance times, held out, relative."""

SURROGATE = 0.01
"""Our surrogates against our simulation at the paper's optimum, relative."""

CHANGE_POINTS = 6.0
"""Relative changes of strokes and energies over D or M, in percentage points: 5 mm at both ends of a 220 mm stroke make
3, and the paper's rows scatter by more."""

CHANGE_POINTS_OF_PEAKS = 1.5
"""Relative changes of peak accelerations, TS and TAMA, in percentage points."""
