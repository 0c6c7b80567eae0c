"""``trainmj paper``: Liu et al. 2022 (doi 10.1186/s10033-022-00755-8) computed again, once for all tests here.

What was wanted is stated in ``scenarios/paper/b_type.targets.yaml``, what is reached is measured. Tables 3 to 8 were
used to identify the devices, so agreement there shows that the identification was carried over; Table 9's strokes and
TS, Table 13 and the balance times were not.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from trainmj.cli import main
from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.identification import load_targets
from trainmj.identification.file import BarsPart
from trainmj.paper import PAGE, bars, collisions, figures, scatter, verdicts
from trainmj.paper.bars import FROM_PRINT, GROUPS
from trainmj.paper.floors import floor
from trainmj.paper.output import summary, write_paper
from trainmj.paper.printed import STROKES, published, rms
from trainmj.paper.reproduce import Reproduction, reproduce
from trainmj.paper.tables import OURS, S08, Comparison, strokes_of
from trainmj.scenario import load
from trainmj.units import G

NEED_NOT_HOLD = (  # what the paper says of its own results, and ours may contradict
    ("3.2, scenario 2", "Strokes gradually decrease"),
    ("7", "Signs of D's correlations"),
    ("7", "Responses strongly correlated with D"),
    ("9", "The optimum improves both criteria"),
)


@pytest.fixture(scope="module")
def paper() -> Reproduction:
    """With every tenth stiffness and empty stroke of the pictures of the scatter: a tenth of the time."""
    found = reproduce()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scatter, "STIFFNESSES", scatter.STIFFNESSES[5::10])  # 47 000 kN/mm is among them
        patch.setattr(scatter, "FINE_MM", 5.0)
        assert found.scatter, "computed here, once"
    return found


@pytest.fixture(scope="module")
def folder(paper, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("paper")
    write_paper(paper, path, formats=())
    return path


# numbers


REACHED = {  # not what was wanted: what the shipped curves came to, so that no change makes it worse unseen
    "Tables 4, 7: each peak acceleration": 1.308,
    "Tables 4, 7: peak of M5, rms": 0.00569,
    "Tables 3, 6: S12, rms": 7.52,
    "Tables 3, 6: S23, rms": 5.86,
    "Tables 3, 6: energy of S1-M1, rms": 0.481,
    "Tables 3, 6: energy of M1-M2, rms": 2.60,
    "Tables 3, 6: energy of M2-M3, rms": 2.20,
    "Tables 5, 8: TS": 0.714,
    "Table 5: TAMA": 0.0984,
    "Table 7: mean of each row (TAMA)": 0.143,
    "Table 9: TS": 0.704,
    "Table 9: S12, rms": 9.12,
    "Table 9: S12, mean deviation": -3.30,
    "Table 9: S23, rms": 9.43,
    "Table 13: TAMA, printed to 0.01 g": 0.00725,
    "Balance times": 1.87,
}


@pytest.mark.parametrize("item", REACHED)
def test_reached_as_before(paper, item):
    """A regression, not a judgement: the deviation from the paper that the documentation states."""
    found = next(v for v in paper.verdicts if v.item == item)
    assert found.deviation == pytest.approx(REACHED[item], rel=0.005)


def test_bars_that_are_missed_are_those_that_are_known_to_be(paper):
    """Fails if a bar that was met is missed, or if verify leaves out one that is met."""
    assert {v.item for v in paper.missed} == bars.MISSED
    assert all(sum(v.bar is not None for v in paper.verdicts if v.group == group) >= 2 for group in GROUPS)


def test_bars_are_those_of_the_targets_file(paper, monkeypatch):
    """A second home for a bar, set above our result, would let a miss pass for agreement."""
    stated = load_targets("b_type").spec.targets
    wanted = {v.item: v.bar for v in paper.verdicts}
    assert wanted["Tables 4, 7: each peak acceleration"] == 1.0
    assert wanted["Tables 5, 8: TS"] == 0.5
    assert wanted["Table 9: TS"] == pytest.approx(0.6)
    assert wanted["Tables 4, 7: peak of M1, rms"] == stated["a_M1"].bars.rms
    each = {stated[f"a_M{n}"].bars.each for n in range(1, 7)}, {stated[f"t_M{n}"].bars.each for n in range(1, 4)}
    assert [len(bars_of_all) for bars_of_all in each] == [1, 1], "items that judge several targets by the bar of one"
    changed = dict(bars._stated()) | {"TS": BarsPart(each="0.72 %")}
    monkeypatch.setattr(bars, "_stated", lambda: changed)
    judged = {v.item: v.met for v in verdicts.verdicts_of_collisions(paper.tables)}
    assert judged["Tables 5, 8: TS"] is True


def test_floors_are_below_what_is_reached_and_fall_with_the_scatter(paper):
    """A floor above our own deviation, or one of values without scatter, would excuse a miss that is ours."""
    floors = {v.item: v for v in paper.verdicts if v.floor is not None}
    assert all(v.floor <= abs(v.deviation) + 1e-9 for v in floors.values())
    assert floors["Tables 4, 7: each peak acceleration"].floor == pytest.approx(1.006, abs=0.002)
    cases = np.array([(d, m) for d in (20.0, 35.0, 50.0) for m in (30.0, 33.0, 36.0)])
    law = 1300 - 0.9 * cases[:, 0] + 35 * cases[:, 1] + 0.1 * cases[:, 1] ** 2
    assert floor("each", cases, law, law, True, False) == pytest.approx(0.0, abs=1e-9)
    one = law + np.where(np.arange(9) == 4, 9.0, 0.0)  # a quadratic can take less than all of it
    assert 0.5 < floor("each", cases, one, law, False, False) < 4.5
    assert floor("rms", cases, one, law, False, False) < 3.0
    assert floor("mean", cases, one, law, False, False) is None


@pytest.mark.thorough
def test_a_missed_bar_is_in_the_headline_and_never_called_agreement(paper, folder):
    """Breaks if a reader of the first lines, the page or the files could take a miss for agreement."""
    n, missed = len(paper.judged), len(paper.missed)
    page = (folder / PAGE).read_text(encoding="utf-8")
    assert f"{n - missed} of {n} bars met; {missed} missed" in page
    files = pd.read_csv(folder / "verdicts.csv")
    assert set(files.loc[files["met"].astype(str) == "False", "item"]) == bars.MISSED
    assert {"bar", "deviation", "floor"} <= set(files)
    assert len(summary(paper)["bars"]["missed"]) == missed


def test_s08_as_documented_explains_the_scatter_over_D(paper):
    """Held out are D = 23 and 47 mm of Table 9; the law that locks leaves several times as much."""
    left = paper.scatter.left.set_index(["series", "of"])
    printed, ours, s08 = (left.loc[scatter.OVER_D, of] for of in (scatter.PRINTED, OURS, S08))
    assert printed.tolist() == pytest.approx([1.714, 3.658, 1.636], abs=1e-3)
    assert (s08 <= [0.25, 0.4, 0.4]).all(), s08
    assert (left.loc[scatter.HELD_OUT, S08] <= [0.25, 0.4, 0.45]).all(), left
    assert (ours >= 3 * s08).all()
    over_M = left.loc[scatter.OVER_M, S08] / left.loc[scatter.OVER_M, scatter.PRINTED]
    assert (over_M > 0.8).all(), "what is said to stay unexplained over the mass is explained"


def unique(found: pd.DataFrame) -> None:
    """One stiffness from 1e3 to 4e5 kN/mm explains the scatter, and none far from it does as well."""
    misfit = found.set_index("K_kN_per_mm")["misfit"]
    assert 46_000 <= misfit.idxmin() <= 48_500
    assert misfit.min() < 0.03
    assert misfit[(misfit.index < 40e3) | (misfit.index > 53e3)].min() > 0.1


def test_the_stiffness_of_s08_is_unique(paper):
    """Breaks if another stiffness explains the scatter as well, or another one is named as the best."""
    unique(paper.scatter.misfit)
    assert paper.scatter.best == tuple(paper.scatter.misfit.sort_values("misfit").iloc[0])


@pytest.mark.thorough
def test_the_stiffness_of_s08_is_unique_among_all_that_are_tried():
    """Breaks as the test before does, for the stiffnesses that it leaves out."""
    unique(scatter.misfit_over_stiffness(0, scatter.STIFFNESSES))


def test_the_scatter_is_that_of_a_known_fit():
    """The curves of b_type with K = 46 662 kN/mm in couplers A-B and 50 000 at the front, both without dashpots, leave
    0.18, 0.32, 0.36 mm: breaks if what is left is counted in another way.
    """
    free = {f"devices.{name}.damping_kN_s_per_m": 0 for name in ("front", "coupler_a_b")}
    stiff = {"devices.front.stiffness_kN_per_mm": 50e3, "devices.coupler_a_b.stiffness_kN_per_mm": 46_662}
    three = published("3")
    case = load("b_type", free | stiff | {"simulation.step_ms": 0.02})
    chains = {d: line_up(case.with_values({"empty_stroke_mm": float(d)})) for d in three["D_mm"]}
    found = dict(run_chains(chains.items()))
    ours = pd.DataFrame([strokes_of(found[d]) for d in chains])
    off = {h: three[h].to_numpy() - ours[h].to_numpy() for h in STROKES}
    left = [rms(scatter.about_line(three["D_mm"].to_numpy(float), values)) for values in off.values()]
    assert left == pytest.approx([0.18, 0.32, 0.36], abs=0.005)


def test_s08_as_documented_reaches_the_rest_too(paper):
    """TS, held out too; and M1's peak as a mean over windows, which is one force in all rows of Tables 4 and 7."""
    of = {v.item: v.s08 for v in paper.verdicts}
    assert abs(of["Tables 5, 8: TS"]) <= 0.6
    assert abs(of["Table 9: TS"]) <= 0.62
    assert abs(of["Table 13: TS"]) <= 0.2
    assert of["Balance times"] is None
    for number, masses in (("4", 33.0), ("7", paper.tables["7"].keys["M_t"])):
        force = paper.tables[number].found[S08]["peak_acc_m1_g"] * masses * G
        np.testing.assert_allclose(force, 930.05, rtol=2e-4)


def test_a_number_that_is_off_is_told(paper):
    """The verdicts are computed: one digit of a published table changed, and its verdict turns."""
    twelve = paper.tables["12"]
    mended = twelve.published.copy()
    mended.loc[0, "entropy"] += 1e-5
    found = verdicts.verdicts({**paper.tables, "12": replace(twelve, published=mended)})
    assert [v.item for v in found if v.met is False and v.group == FROM_PRINT] == ["Table 12"]
    shifted = paper.tables["9"].found[OURS].assign(anti_climber_mm=lambda t: t["anti_climber_mm"] + 2.5)
    found = verdicts.verdicts({**paper.tables, "9": replace(paper.tables["9"], found={OURS: shifted, S08: shifted})})
    assert {v.item for v in found if v.met is False} - bars.MISSED == {"Table 9: S_anti, mean deviation"}


def test_17_cases_count_once_in_tables_3_and_6(paper):
    assert len(collisions.one_factor_cases()) == 17
    assert len(collisions.all_cases()) == 28
    both = next(v for v in paper.verdicts if v.item.startswith("Tables 4, 7: each"))
    assert both.published == "102 values"


def test_cases_end_on_their_own(paper):
    for case, found in paper.collisions.summaries.items():
        limited = str(found.status).startswith("stroke exhausted at S1-M1 anti_climber")
        assert str(found.status) == "over" or limited, (case, found.status)
        # Tables 3 and 6 themselves pass the limit that Eq. (12) sets for the anti-climber
        assert limited == (found.interfaces[0].stages[1].stroke_mm > 265.0)


def test_our_front_and_optimum_keep_the_limits_of_eq_12_on_the_surrogates(paper):
    table = paper.ours.front_table()
    assert (table["anti_climber_mm"] <= 265.0 + 1e-9).all()
    assert table["D_mm"].between(20, 50).all()
    assert table["M_t"].between(30, 36).all()
    D, M = paper.ours.chosen
    assert ((table["D_mm"] == D) & (table["M_t"] == M)).any()


def test_our_surrogates_are_fitted_to_our_responses(paper):
    D, M = 33.0, 34.0  # the sixth point of Table 9
    simulated = paper.collisions.summaries[D, M]
    assert paper.ours.predict(D, M)["TS_mm"] == pytest.approx(simulated.TS_mm, rel=0.005)
    assert paper.ours.predict(D, M)["TAMA_g"] == pytest.approx(simulated.TAMA_g, rel=0.005)


# laws


def test_laws_hold_on_our_results(paper):
    def free(law) -> bool:
        return any(law.section == section and law.statement.startswith(said) for section, said in NEED_NOT_HOLD)

    failing = [law for law in paper.laws if not (law.holds or law.impossible or free(law))]
    assert not failing, "\n".join(f"{law.section} {law.statement}: {law.ours}" for law in failing)
    assert len(paper.laws) > 40


def test_what_momentum_forbids_is_shown_by_arithmetic(paper):
    """Breaks if both trains' final speeds are lower with bodies that give, or the sum of momentum is not shown."""
    cannot = [law for law in paper.laws if law.impossible]
    assert [law.section for law in cannot] == ["3.2, scenario 1", "3.2, scenario 2"]
    for law, rigid, elastic in zip(cannot, paper.collisions.scenarios, paper.collisions.elastic, strict=True):
        assert not law.holds
        masses_and_changes = re.findall(r"([\d.]+) t x \(([+-][\d.]+) km/h\)", law.impossible)
        (mass, fall), (other, rise) = ((float(m), float(v)) for m, v in masses_and_changes)
        assert mass == pytest.approx(rigid.chain.mass[: rigid.chain.n_moving].sum() / 1e3)
        assert fall < 0 < rise
        left = float(re.search(r"= ([+-][\d.]+) t km/h", law.impossible)[1])
        assert mass * fall + other * rise == pytest.approx(left, abs=0.2), "0.001 km/h of 200 t"
        assert abs(left) < 0.02 * mass * rise
        assert elastic.chain.members


def test_the_optimum_does_not_improve_both_criteria(paper):
    assert not next(law for law in paper.laws if law.section == "9").holds


# figures and files


def test_compression_over_time_ends_where_the_summary_says(paper):
    result, found = paper.collisions.over("D")[-1]
    front = figures.compression(result, result.chain.front)
    assert front.max() * 1e3 == pytest.approx(found.interfaces[0].crush_mm, abs=0.5)  # records are 1 ms apart
    assert (np.diff(front) > -1e-3).all(), "an empty stroke must not count"
    plateau = np.isclose(front, 0.353, atol=1e-9)
    assert plateau.sum() > 5, "D is passed at a constant compression"


@pytest.mark.thorough
def test_labels_of_figures_6_and_8_are_whole(paper):
    """Breaks if the name of an axis is cut by the edge of a figure, or is a letter alone."""
    from trainmj.output.style import styled

    with styled("page"):
        for factor, axis in (("D", "Empty stroke D (mm)"), ("M", "Mass M (t)")):
            drawn = figures._vehicles(paper.collisions, factor)
            drawn.draw_without_rendering()
            panels = drawn.get_axes()
            texts = [text for panel in panels for text in (panel.xaxis.label, panel.yaxis.label)]
            assert {text.get_text() for text in texts} == {"", axis, "Speed (km/h)", "Time (s)"}
            for text in texts:
                box = text.get_window_extent()
                assert not text.get_text() or drawn.bbox.padded(1).contains(*box.min), text
                assert not text.get_text() or drawn.bbox.padded(1).contains(*box.max), text


@pytest.mark.thorough
def test_every_table_is_a_file_with_published_ours_and_deviation(paper, folder):
    three = pd.read_csv(folder / "table3_devices_vs_D.csv")
    printed = published("table3_devices_vs_D")
    np.testing.assert_array_equal(three["anti_climber_published_mm"], printed["anti_climber_mm"])
    np.testing.assert_allclose(
        three["anti_climber_ours_mm"] - three["anti_climber_published_mm"],
        three["anti_climber_deviation_ours_mm"],
        atol=1e-5,
    )
    assert {"anti_climber_s08_mm", "anti_climber_deviation_s08_mm"} <= set(three)
    ten = pd.read_csv(folder / "table10_correlation.csv")
    assert {"TS_published", "TS_from_table_9", "TS_ours", "TS_deviation_ours"} <= set(ten.columns)
    for table in paper.tables.values():
        assert len(pd.read_csv(folder / f"{table.name}.csv")) == len(table.published)


@pytest.mark.thorough
def test_the_page_says_every_verdict_law_and_defect_and_asks_for_nothing(paper, folder):
    text = (folder / PAGE).read_text(encoding="utf-8")
    for said in (*(v.item for v in paper.verdicts), *(law.statement for law in paper.laws)):
        assert said.replace("'", "&#39;") in text, said
    for defect in paper.defects:
        assert defect.title.replace("'", "&#39;") in text
    assert all(f"<figcaption>{caption}" in text for caption in figures.CAPTIONS.values())
    assert 'src="http' not in text
    assert 'href="http' not in text


def test_the_command_prints_within_80_columns_and_as_json(paper, monkeypatch):
    monkeypatch.setattr("trainmj.paper.reproduce.reproduce", lambda threads=0: paper)
    shown = CliRunner().invoke(main, ["paper"])
    assert shown.exit_code == 0, shown.output
    assert max(map(len, shown.output.splitlines())) <= 80
    n, missed = len(paper.judged), len(paper.missed)
    assert f"{n - missed} of {n} bars met; {missed} missed:" in shown.output.splitlines()[2]
    assert "agree" not in shown.output
    assert "Defects of the paper" in shown.output
    spoken = CliRunner().invoke(main, ["paper", "--json"])
    assert json.loads(spoken.output) == json.loads(json.dumps(summary(paper)))


def test_a_folder_that_cannot_be_made_is_said_before_anything_is_computed(tmp_path, monkeypatch):
    monkeypatch.setattr("trainmj.paper.reproduce.reproduce", lambda threads=0: pytest.fail("computed first"))
    (tmp_path / "file").write_text("")
    shown = CliRunner().invoke(main, ["paper", "--out", str(tmp_path / "file" / "out")])
    assert shown.exit_code == 2
    assert "cannot be made a folder" in shown.output


# Table 2


def test_table_2_scenarios_ship_as_printed(paper):
    two = paper.tables["2"]
    for head in two.heads:
        np.testing.assert_allclose(two.deviation(head), 0.0, atol=0.01, err_msg=head)


def test_parameters_of_the_paper_are_set_by_their_short_names():
    """``--set empty_stroke_mm=35 --set mass_t=33 --set speed_km_h=25`` on the standard case."""
    from trainmj.collision.lineup import line_up

    changed = line_up(load("b_type", {"empty_stroke_mm": 41, "mass_t": 31.5, "speed_km_h": 20}))
    assert changed.mass == pytest.approx([31.5e3] * 12)
    assert changed.speed == pytest.approx([20 / 3.6] * 6 + [0] * 6)
    assert changed.interfaces[5].devices[0].stages[1].start == pytest.approx(0.353 + 0.041)


def test_comparison_keeps_units_in_the_heads():
    table = pd.DataFrame({"TS_mm": [1.0, 2.0], "R2": [0.5, 0.25]})
    ours = pd.DataFrame({"TS_mm": [1.5, 2.0], "R2": [0.5, 0.5]})
    found = Comparison("t", "T", pd.DataFrame({"D_mm": [20, 50]}), table, {OURS: ours})
    assert list(found.table().columns) == [
        "D_mm",
        *("TS_published_mm", "TS_ours_mm", "TS_deviation_mm"),
        *("R2_published", "R2_ours", "R2_deviation"),
    ]
    assert found.rms("TS_mm") == pytest.approx(0.5 / np.sqrt(2))
    assert found.changes("TS") == pytest.approx((100.0, 100 * (2.0 / 1.5 - 1)))
