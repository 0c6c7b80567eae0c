"""Each published table beside what was found: by us on the simulator, or from the paper's own Table 9."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from trainmj.collision.device import Array
from trainmj.paper.analysis import CRITERIA, Analysis, entropies
from trainmj.paper.collisions import Case, cases_of
from trainmj.paper.printed import EMPTY_STROKE_MM, MASS_T, numbers, published, split_unit
from trainmj.units import KM_H, TONNE
from trainmj.units import head as head_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from trainmj.collision.result import Result
    from trainmj.collision.summary import Summary

OURS = "ours"
RECOMPUTED = "from_table_9"

_KEYS = ("scenario", "test", "method", "parameter", "value", "vehicle", "term", "criterion", "D_mm", "M_t")
_D = f"over the empty stroke D, at {MASS_T:g} t"
_M = f"over the mass M, at D = {EMPTY_STROKE_MM:g} mm"

_COLLISIONS = {  # by number: file, title, note
    "3": ("table3_devices_vs_D", f"Table 3. Strokes and energies {_D}", ""),
    "4": ("table4_acceleration_vs_D", f"Table 4. Peak accelerations {_D}", ""),
    "5": ("table5_criteria_vs_D", f"Table 5. TS and TAMA {_D}", ""),
    "6": ("table6_devices_vs_M", f"Table 6. Strokes and energies {_M}", ""),
    "7": ("table7_acceleration_vs_M", f"Table 7. Peak accelerations {_M}", ""),
    "8": (
        "table8_criteria_vs_M",
        f"Table 8. TS and TAMA {_M}",
        "The printed TAMA is not the mean of Table 7's rows; ours follows Table 7. See the defects.",
    ),
    "9": (
        "table9_doe_responses",
        "Table 9. The ten points of the study (never used to identify the devices)",
        "The printed accelerations come from other forces than those of Tables 4 and 7. See the defects.",
    ),
    "13": (
        "table13_optimum",
        "Table 13. The paper's optimum, on the surrogates and by collision dynamics",
        "The row of the collision dynamics is our simulation under both heads: it was never used to identify the "
        "devices.",
    ),
}

_STUDY: dict[
    str, tuple[str, str, Callable[[Analysis], pd.DataFrame], str]
] = {  # by number: file, title, what an analysis has for it, note
    "10": ("table10_correlation", "Table 10. Correlation coefficients", lambda a: a.correlation.matrix(), ""),
    "Eqs": (
        "eq7_eq8_coefficients_as_printed",
        "Eqs (7) and (8). Coefficients of the cubic surrogates, D in mm and M in t",
        Analysis.coefficients,
        "A published 0 is a term that Eq. (8) does not have as printed. See the defects.",
    ),
    "11": (
        "table11_surrogate_accuracy",
        "Table 11. Accuracy of the surrogates: each point left out in turn, errors over the range",
        Analysis.accuracies,
        "",
    ),
    "12": (
        "table12_entropy_weights",
        "Table 12. Entropy weights of the criteria",
        lambda a: entropies(a.responses),
        "",
    ),
}


@dataclass(frozen=True, eq=False)
class Comparison:
    """A published table and its counterparts.

    Attributes:
        name: of the file, without ending.
        title: number and subject of the published table.
        keys: what the rows are, (n, k).
        published: the printed numbers, (n, q); heads with units.
        found: the same heads, by where they come from: ``ours`` or ``from_table_9``.
        note: what a reader must know to judge it; empty if nothing.
    """

    name: str
    title: str
    keys: pd.DataFrame = field(repr=False)
    published: pd.DataFrame = field(repr=False)
    found: Mapping[str, pd.DataFrame] = field(repr=False)
    note: str = ""

    @property
    def heads(self) -> list[str]:
        """Heads of the compared quantities."""
        return [str(head) for head in self.published.columns]

    def pair(self, head: str, source: str = OURS) -> tuple[Array, Array]:
        """Published and found values of a quantity, (n,) each."""
        return numbers(self.published, head), numbers(self.found[source], head)

    def deviation(self, head: str, source: str = OURS) -> Array:
        """Found less published, (n,), in the unit of the head."""
        printed, found = self.pair(head, source)
        return found - printed

    def rms(self, head: str) -> float:
        """Root mean square of our deviation."""
        return float(np.sqrt(np.mean(self.deviation(head) ** 2)))

    def changes(self, quantity: str) -> tuple[float, float]:
        """Last row over first row less 1 [%] of a quantity, its unit left out: published and ours."""
        (head,) = (h for h in self.heads if split_unit(h)[0] == quantity)
        printed, ours = (100 * float(values[-1] / values[0] - 1) for values in self.pair(head))
        return printed, ours

    def table(self) -> pd.DataFrame:
        """Everything side by side: keys, then published, found and deviation of each quantity, units in the heads."""
        import pandas as pd

        columns = {str(k): self.keys[k].to_numpy() for k in self.keys.columns}
        for head in self.heads:
            quantity, unit = split_unit(head)
            columns[head_of(f"{quantity}_published", unit)] = self.published[head].to_numpy()
            for source, values in self.found.items():
                columns[head_of(f"{quantity}_{source}", unit)] = values[head].to_numpy()
                deviation = "deviation" if len(self.found) == 1 else f"deviation_{source}"
                columns[head_of(f"{quantity}_{deviation}", unit)] = self.deviation(head, source)
        return pd.DataFrame(columns)


def _compare(name: str, title: str, found: Mapping[str, pd.DataFrame], note: str = "") -> Comparison:
    """A published table beside what was found under its heads."""
    table = published(name)
    keys = [head for head in table if head in _KEYS]
    return Comparison(name.removesuffix("_as_printed"), title, table[keys], table.drop(columns=keys), found, note)


def compare_collisions(summaries: Mapping[Case, Summary]) -> dict[str, Comparison]:
    """Tables 3 to 9, 13 and the balance times by number; under both methods of Table 13 is what was simulated."""
    import pandas as pd

    tables = {}
    for number, (name, title, note) in _COLLISIONS.items():
        printed = published(name)
        ours = pd.DataFrame([responses(summaries[case]) for case in cases_of(printed)])
        tables[number] = _compare(name, title, {OURS: ours[[head for head in printed if head in ours]]}, note)
    return tables | {"balance": _balance_times(summaries)}


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


def _balance_times(summaries: Mapping[Case, Summary]) -> Comparison:
    """When vehicles reach the speed of those in front of them, Sections 5.2 and 6.2."""
    import pandas as pd

    table = published("balance_times")
    ours = []
    for parameter, value, vehicle in zip(table["parameter"], table["value"], table["vehicle"], strict=True):
        case = (float(value), MASS_T) if parameter == "D_mm" else (EMPTY_STROKE_MM, float(value))
        times = {v.name: v.balance_time_s for v in summaries[case].vehicles}
        ours.append(times["M3" if vehicle == "M3-M6" else vehicle])
    return _compare(
        "balance_times",
        "Velocity balance times (text of Sections 5.2 and 6.2; never used to identify the devices)",
        {OURS: pd.DataFrame({"balance_time_s": ours})},
        "A vehicle's balance time is when the interface in front of it has its largest stroke. Of M3 to M6, M3's is "
        "given: it is the last to load its coupler far.",
    )


def compare_scenarios(scenarios: Sequence[Result]) -> Comparison:
    """Table 2, the boundary conditions of its two scenarios, as printed and as the shipped scenarios have them."""
    import pandas as pd

    rows = []
    for result in scenarios:
        masses = result.chain.mass[: result.chain.n_moving] / TONNE
        speed = float(result.chain.speed[0]) / KM_H
        rows.append((masses[0], masses[1], masses.sum(), speed, result.chain.rail_friction))
    name = "table2_scenarios"
    ours = pd.DataFrame(rows, columns=published(name).columns[1:])
    return _compare(name, "Table 2. Collision scenarios of the model validation", {OURS: ours})


def compare_studies(thirteen: Comparison, studies: Mapping[str, Analysis]) -> dict[str, Comparison]:
    """Tables 10 to 13 and Eqs (7), (8) by number.

    Args:
        thirteen: Table 13 with what was simulated.
        studies: on the published Table 9 and on ours, by source.
    """
    tables = {
        number: _compare(name, title, {source: of(study) for source, study in studies.items()}, note)
        for number, (name, title, of, note) in _STUDY.items()
    }
    found = {}
    for source, study in studies.items():
        values = thirteen.found[OURS].copy()
        for row, (method, D, M) in enumerate(thirteen.keys.itertuples(index=False)):
            if method == "surrogate":
                values.loc[row] = study.predict(D, M)
        found[source] = values[list(CRITERIA.values())]
    return tables | {"13": replace(thirteen, found=found)}
