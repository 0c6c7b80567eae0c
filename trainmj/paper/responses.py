"""Tables 2 to 9 and the balance times: one function each, published beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from trainmj.paper.collisions import Case, Collisions, cases_of
from trainmj.paper.comparison import OURS, Comparison
from trainmj.paper.printed import EMPTY_STROKE_MM, MASS_T, over_D, over_M, published
from trainmj.units import KM_H, TONNE

if TYPE_CHECKING:
    import pandas as pd

    from trainmj.collision.summary import Summary


def responses(summary: Summary) -> dict[str, float]:
    """A collision's responses under the heads of the published tables; at the front those of one train."""
    front, second, third = summary.interfaces[:3]
    coupler, anti_climber = front.stages
    return {
        "coupler_mm": coupler.stroke_mm,
        "anti_climber_mm": anti_climber.stroke_mm,
        "stroke_m1_m2_mm": second.stroke_mm,
        "stroke_m2_m3_mm": third.stroke_mm,
        "energy_s1_m1_kJ": front.energy_kJ,
        "energy_m1_m2_kJ": second.energy_kJ,
        "energy_m2_m3_kJ": third.energy_kJ,
        **{f"peak_acc_m{n}_g": v.peak_device_acceleration_g for n, v in enumerate(summary.vehicles[:6], start=1)},
        "TS_mm": summary.TS_mm,
        "TAMA_g": summary.TAMA_g,
    }


def our_responses(collisions: Collisions, cases: Sequence[Case], heads: Sequence[str]) -> pd.DataFrame:
    """Our responses in some cases, (n, q), under the heads of the published tables."""
    import pandas as pd

    return pd.DataFrame([responses(collisions.summaries[case]) for case in cases])[list(heads)]


def table_2(collisions: Collisions) -> Comparison:
    """Boundary conditions of the two scenarios, as printed and as the shipped scenarios have them."""
    import pandas as pd

    rows = []
    for result in collisions.scenarios:
        masses = result.chain.mass[: result.chain.n_moving] / TONNE
        speed = float(result.chain.speed[0]) / KM_H
        rows.append((masses[0], masses[1], masses.sum(), speed, result.chain.rail_friction))
    table = published("table2_scenarios")
    printed = table.drop(columns="scenario")
    ours = pd.DataFrame(rows, columns=printed.columns)
    title = "Table 2. Collision scenarios of the model validation"
    return Comparison("table2_scenarios", title, table[["scenario"]], printed, {OURS: ours})


def table_3(collisions: Collisions) -> Comparison:
    """Strokes and energies over the empty stroke."""
    title = f"Table 3. Strokes and energies over the empty stroke D, at {MASS_T:g} t"
    return _compare("table3_devices_vs_D", title, over_D("table3_devices"), "D_mm", collisions)


def table_4(collisions: Collisions) -> Comparison:
    """Peak accelerations over the empty stroke."""
    title = f"Table 4. Peak accelerations over the empty stroke D, at {MASS_T:g} t"
    return _compare("table4_acceleration_vs_D", title, over_D("table4_acceleration"), "D_mm", collisions)


def table_5(collisions: Collisions) -> Comparison:
    """TS and TAMA over the empty stroke."""
    title = f"Table 5. TS and TAMA over the empty stroke D, at {MASS_T:g} t"
    return _compare("table5_criteria_vs_D", title, over_D("table5_criteria"), "D_mm", collisions)


def table_6(collisions: Collisions) -> Comparison:
    """Strokes and energies over the mass."""
    title = f"Table 6. Strokes and energies over the mass M, at D = {EMPTY_STROKE_MM:g} mm"
    return _compare("table6_devices_vs_M", title, over_M("table6_devices"), "M_t", collisions)


def table_7(collisions: Collisions) -> Comparison:
    """Peak accelerations over the mass."""
    title = f"Table 7. Peak accelerations over the mass M, at D = {EMPTY_STROKE_MM:g} mm"
    return _compare("table7_acceleration_vs_M", title, over_M("table7_acceleration"), "M_t", collisions)


def table_8(collisions: Collisions) -> Comparison:
    """TS and TAMA over the mass."""
    return _compare(
        "table8_criteria_vs_M",
        f"Table 8. TS and TAMA over the mass M, at D = {EMPTY_STROKE_MM:g} mm",
        over_M("table8_criteria"),
        "M_t",
        collisions,
        "The printed TAMA is not the mean of Table 7's rows; ours follows Table 7. See the defects.",
    )


def table_9(collisions: Collisions) -> Comparison:
    """The ten points of the study."""
    return _compare(
        "table9_doe_responses",
        "Table 9. The ten points of the study (never used to identify the devices)",
        published("table9_doe_responses"),
        ["test", "D_mm", "M_t"],
        collisions,
        "The printed accelerations come from other forces than those of Tables 4 and 7. See the defects.",
    )


def balance_times(collisions: Collisions) -> Comparison:
    """When vehicles reach the speed of those in front of them, Sections 5.2 and 6.2."""
    import pandas as pd

    table = published("balance_times")
    ours = []
    for parameter, value, vehicle in zip(table["parameter"], table["value"], table["vehicle"], strict=True):
        case = (float(value), MASS_T) if parameter == "D_mm" else (EMPTY_STROKE_MM, float(value))
        times = {v.name: v.balance_time_s for v in collisions.summaries[case].vehicles}
        ours.append(times["M3" if vehicle == "M3-M6" else vehicle])
    return Comparison(
        "balance_times",
        "Velocity balance times (text of Sections 5.2 and 6.2; never used to identify the devices)",
        table[["parameter", "value", "vehicle"]],
        table[["balance_time_s"]],
        {OURS: pd.DataFrame({"balance_time_s": ours})},
        "A vehicle's balance time is when the interface in front of it has its largest stroke. Of M3 to M6, M3's is "
        "given: it is the last to load its coupler far.",
    )


def _compare(
    name: str, title: str, table: pd.DataFrame, keys: str | list[str], collisions: Collisions, note: str = ""
) -> Comparison:
    rows = [keys] if isinstance(keys, str) else keys
    printed = table.drop(columns=[*{*rows, "D_mm", "M_t"}])
    ours = our_responses(collisions, cases_of(table), list(printed.columns))
    return Comparison(name, title, table[rows], printed, {OURS: ours}, note)
