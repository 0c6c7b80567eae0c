"""Each published table beside what was found: by us on the simulator, or from the paper's own Table 9."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import pandas as pd

from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.collision.summary import Summary
from trainmj.paper.analysis import Analysis, entropies
from trainmj.paper.collisions import Case, cases_of
from trainmj.paper.printed import (
    EMPTY_STROKE_MM,
    MASS_T,
    PEAKS,
    STROKES,
    TABLES,
    change,
    numbers,
    published,
    rms,
    split_unit,
)
from trainmj.units import KM_H, TONNE
from trainmj.units import head as head_of

OURS = "ours"
S08 = "s08"
RECOMPUTED = "from_table_9"

_KEYS = ("scenario", "test", "method", "parameter", "value", "vehicle", "term", "criterion", "D_mm", "M_t")
_D = f"over the empty stroke D, at {MASS_T:g} t"
_M = f"over the mass M, at D = {EMPTY_STROKE_MM:g} mm"

_TITLES = {
    "2": "Table 2. Collision scenarios of the model validation",
    "3": f"Table 3. Strokes and energies {_D}",
    "4": f"Table 4. Peak accelerations {_D}",
    "5": f"Table 5. TS and TAMA {_D}",
    "6": f"Table 6. Strokes and energies {_M}",
    "7": f"Table 7. Peak accelerations {_M}",
    "8": f"Table 8. TS and TAMA {_M}",
    "9": "Table 9. The ten points of the study (never used to identify the devices)",
    "10": "Table 10. Correlation coefficients",
    "Eqs": "Eqs (7) and (8). Coefficients of the cubic surrogates, D in mm and M in t",
    "11": "Table 11. Accuracy of the surrogates: each point left out in turn, errors over the range",
    "12": "Table 12. Entropy weights of the criteria",
    "13": "Table 13. The paper's optimum, on the surrogates and by collision dynamics",
    "balance": "Velocity balance times (text of Sections 5.2 and 6.2; never used to identify the devices)",
}

_NOTES = {
    "8": "The printed TAMA is not the mean of Table 7's rows; ours follows Table 7. See the defects.",
    "9": "The printed accelerations come from other forces than those of Tables 4 and 7. See the defects.",
    "Eqs": "A published 0 is a term that Eq. (8) does not have as printed. See the defects.",
    "13": "The row of the collision dynamics is our simulation under both heads: it was never used to identify the "
    "devices.",
    "balance": "A vehicle's balance time is when the interface in front of it has its largest stroke. Of M3 to M6, "
    "M3's is given: it is the last to load its coupler far. Not for S08: as the train rings, strokes go on growing by "
    "less than 0.01 mm, so that the largest comes late.",
}

_OF_A_STUDY: dict[str, Callable[[Analysis], pd.DataFrame]] = {
    "10": lambda study: study.correlation.matrix(),
    "Eqs": Analysis.coefficients,
    "11": Analysis.accuracies,
    "12": lambda study: entropies(study.responses),
}
"""What stands against Tables 10 to 12 and Eqs (7), (8)."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """A published table and its counterparts."""

    name: str  # of the file, without ending
    title: str  # number and subject of the published table
    keys: pd.DataFrame  # what the rows are, (n, k)
    published: pd.DataFrame  # the printed numbers, (n, q); heads with units
    found: Mapping[str, pd.DataFrame]  # the same heads, by where they come from: OURS, S08, RECOMPUTED
    note: str = ""  # what a reader must know to judge it

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
        return rms(self.deviation(head))

    def changes(self, quantity: str) -> tuple[float, float]:
        """Last row over first row less 1 [%] of a quantity, its unit left out: published and ours."""
        (head,) = (h for h in self.heads if split_unit(h)[0] == quantity)
        printed, ours = self.pair(head)
        return change(printed), change(ours)

    def table(self) -> pd.DataFrame:
        """Everything side by side: keys, then published, found and deviation of each quantity, units in the heads."""
        columns = {str(k): self.keys[k].to_numpy() for k in self.keys.columns}
        for head in self.heads:
            quantity, unit = split_unit(head)
            columns[head_of(f"{quantity}_published", unit)] = self.published[head].to_numpy()
            for source, values in self.found.items():
                columns[head_of(f"{quantity}_{source}", unit)] = values[head].to_numpy()
                deviation = "deviation" if len(self.found) == 1 else f"deviation_{source}"
                columns[head_of(f"{quantity}_{deviation}", unit)] = self.deviation(head, source)
        return pd.DataFrame(columns)


Tables = Mapping[str, Comparison]
"""Comparisons by the number of their table: ``"3"``, ``"10"``, ``"Eqs"``, ``"balance"``."""


def compare(number: str, found: Mapping[str, pd.DataFrame]) -> Comparison:
    """A published table beside what was found under its heads, by where that comes from."""
    table = published(number)
    keys = [head for head in table if head in _KEYS]
    name = TABLES[number].removesuffix("_as_printed")
    return Comparison(name, _TITLES[number], table[keys], table.drop(columns=keys), found, _NOTES.get(number, ""))


def compare_collisions(laws: Mapping[str, Mapping[Case, Summary]]) -> dict[str, Comparison]:
    """Tables 3 to 9, 13 and the balance times by number; under both methods of Table 13 is what was simulated.

    Args:
        laws: collisions by where they come from, OURS and perhaps S08; of S08 there are no balance times.
    """
    tables = {}
    for number in ("3", "4", "5", "6", "7", "8", "9", "13"):
        printed = published(number)
        found = {}
        for source, summaries in laws.items():
            one = pd.DataFrame([_responses(summaries[case]) for case in cases_of(printed)])
            found[source] = one[[head for head in printed if head in one]]
        tables[number] = compare(number, found)
    return tables | {"balance": compare("balance", {OURS: _balance_times(laws[OURS])})}


def strokes_of(summary: Summary) -> dict[str, float]:
    """S_anti, S12 and S23 [mm] of a collision under the heads of the published tables."""
    front, second, third = summary.interfaces[:3]
    found = (front.stages[1].stroke_mm, second.stroke_mm, third.stroke_mm)
    return dict(zip(STROKES, found, strict=True))


def _responses(summary: Summary) -> dict[str, float]:
    """A collision's responses under the heads of the published tables; at the front those of one train.

    Accelerations are means over windows where the scenario states some.
    """
    front, second, third = summary.interfaces[:3]
    averaged = "TAMA_averaged_g" in summary.responses
    peaks = [v.averaged_device_acceleration_g if averaged else v.peak_device_acceleration_g for v in summary.vehicles]
    return {
        "coupler_mm": front.stages[0].stroke_mm,
        **strokes_of(summary),
        "energy_s1_m1_kJ": front.energy_kJ,
        "energy_m1_m2_kJ": second.energy_kJ,
        "energy_m2_m3_kJ": third.energy_kJ,
        **dict(zip(PEAKS, peaks, strict=False)),
        "TS_mm": summary.TS_mm,
        "TAMA_g": summary.TAMA_averaged_g if averaged else summary.TAMA_g,
    }


def _balance_times(summaries: Mapping[Case, Summary]) -> pd.DataFrame:
    """When vehicles reach the speed of those in front of them, Sections 5.2 and 6.2."""
    ours = []
    for parameter, value, vehicle, _ in published("balance").itertuples(index=False):
        case = (float(value), MASS_T) if parameter == "D_mm" else (EMPTY_STROKE_MM, float(value))
        times = {v.name: v.balance_time_s for v in summaries[case].vehicles}
        ours.append(times["M3" if vehicle == "M3-M6" else vehicle])
    return pd.DataFrame({"balance_time_s": ours})


def compare_scenarios(scenarios: Sequence[Result]) -> Comparison:
    """Table 2, the boundary conditions of its two scenarios, as printed and as the shipped scenarios have them."""
    rows = []
    for chain in (result.chain for result in scenarios):
        masses = chain.mass[: chain.n_moving] / TONNE
        rows.append((masses[0], masses[1], masses.sum(), float(chain.speed[0]) / KM_H, chain.vehicles[0].rail_friction))
    return compare("2", {OURS: pd.DataFrame(rows, columns=published("2").columns[1:])})


def compare_studies(thirteen: Comparison, studies: Mapping[str, Analysis]) -> dict[str, Comparison]:
    """Tables 10 to 13 and Eqs (7), (8) by number, from studies by their source; thirteen holds what was simulated."""
    tables = {
        number: compare(number, {source: of(study) for source, study in studies.items()})
        for number, of in _OF_A_STUDY.items()
    }
    optimum, simulated = cases_of(thirteen.keys)[0], thirteen.found[OURS].iloc[[1]]
    found = {
        source: pd.concat([pd.DataFrame([study.predict(*optimum)]), simulated], ignore_index=True)
        for source, study in studies.items()
    }
    if S08 in thirteen.found:  # no study was made of it
        found[S08] = thirteen.found[S08].iloc[1:].reindex([0, 1])
    return tables | {"13": replace(thirteen, found=found)}
