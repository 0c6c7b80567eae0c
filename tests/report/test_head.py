"""The head of a report: its cover, its verdict in one sentence, and the bars of what is used."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from importlib import import_module
from types import SimpleNamespace

import pytest
from builders import planar
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.collision.status import Kind, Status
from trainmj.collision.verdict import verdict
from trainmj.errors import InputError
from trainmj.files.cover import Cover
from trainmj.output.blocks import Bar
from trainmj.output.page import Page
from trainmj.output.table import failed, passed
from trainmj.single.beside import Beside
from trainmj.single.used import add_used, capacity
from trainmj.sweep.page import page_of_folder
from trainmj.units import KJ

command = import_module("trainmj.cli.report")  # its package has the command under this name

STATED = {"project": "Line 4", "client": "City & Co", "author": "A. B.", "revision": "B", "date": "2026-05-04"}
OPTIONS = [word for name, text in STATED.items() for word in (f"--{name}", text)]


def head_of(html):
    """Facts of the cover by name, and the verdict, as they are read."""
    found = re.findall(r"<div><dt>(.*?)</dt><dd>(.*?)</dd></div>", html)
    whole = re.search(r'<p class="whole (\w+)"><span[^>]*>.*?</span> (.*?)</p>', html)
    return {name: unescape(text) for name, text in found}, whole and (whole[1], unescape(whole[2]))


class TestCover:
    def test_options_head_the_page_and_are_said_again(self, run_folder, tmp_path):
        """Breaks if an option is lost, or the command in the footer does not make the same page again."""
        files = [tmp_path / name for name in ("a.html", "b.html")]
        for file in files:
            assert CliRunner().invoke(main, ["report", str(run_folder), "--out", str(file), *OPTIONS]).exit_code == 0
        html = files[0].read_text()
        assert head_of(html)[0] == {name.capitalize(): text for name, text in STATED.items()}
        assert "--project &#39;Line 4&#39; --client &#39;City &amp; Co&#39;" in html
        assert files[1].read_text() == html, "no clock is read"

    def test_what_the_scenario_states_gives_way_to_options(self, standard_result, run_folder):
        """Breaks if the two homes of a fact are mixed up, or a changed cover is said among changed values."""
        scenario = standard_result.scenario.with_values({"report.project": "Own", "report.author": "C. D."})
        assert "report" not in scenario.heading
        page = command._page_of_run(run_folder / "result.nc")
        page = replace(page, cover=scenario.report).headed(Cover(author="E. F."))
        assert page.cover.stated == {"project": "Own", "author": "E. F."}

    def test_today_is_read_from_the_clock_by_a_command_alone(self, monkeypatch):
        """Breaks if a file could make a report that differs from day to day."""
        monkeypatch.setattr(command, "date", SimpleNamespace(today=lambda: SimpleNamespace(isoformat=lambda: "D")))
        assert command.cover_given({"date": "today"}).date == "D"
        with pytest.raises(InputError, match=r"report.date.*must be the day itself.*--date today"):
            trainmj.load("b_type", {"report.date": "today"})

    @pytest.mark.parametrize("value", ["two\nlines", 1.1, "x" * 121])
    def test_what_is_no_line_of_text_is_refused(self, value):
        with pytest.raises(InputError, match="revision"):
            command.cover_given({"revision": value})

    def test_a_revision_may_be_a_whole_number(self):
        assert Cover(revision=2).stated == {"revision": "2"}

    def test_options_are_those_of_the_scenario_and_need_a_report(self):
        """Breaks if one of the two homes has a key that the other has not."""
        assert list(command._COVER) == list(Cover.model_fields)
        found = CliRunner().invoke(main, ["run", "b_type", "--author", "A. B."])
        assert (found.exit_code, found.output) == (2, "Error: --author: needs --report, whose page it heads\n")

    def test_a_printed_page_carries_it_and_no_text_can_leave_its_string(self):
        """Breaks if a name could end the style sheet, or printed pages have no numbers."""
        nasty = '"} </style><script>alert(1)</script>'
        html = Page(nasty, cover=Cover(project=nasty, revision="B")).html()
        style = html.partition("<style>")[2].partition("</style>")[0]
        assert "<script>alert" not in html
        assert 'content: counter(page) " of " counter(pages)' in style
        assert '@top-right { content: "revision B"' in style


class TestVerdict:
    def test_names_the_nearest_limit_and_how_much_is_used(self, standard_summary):
        nearest = max(standard_summary.limits, key=lambda c: c.used)
        found = verdict(standard_summary)
        assert found.kind == "pass"
        assert found.text == f"All 5 limits are kept; nearest: {nearest.said}, 86 % used."

    def test_speaks_of_two_limits_as_both(self, standard_summary):
        """Breaks if a client reads "All 2 limits"."""
        two = verdict(replace(standard_summary, limits=standard_summary.limits[:2]))
        assert two.text.startswith("Both limits are kept; nearest: ")

    @pytest.mark.parametrize(
        ("changes", "kind", "said"),
        [
            ({"found": 291.5}, "fail", "1 of 5 limits is passed: stroke.*291.5 of 265 mm.*, 10 % over"),
            ({"found": 265.02}, "fail", r"265.02 of 265 mm\), 0.0075 % over"),
            ({"found": 795.0}, "fail", ", 3 times the limit"),
            ({"found": float("nan")}, "fail", r"\(no number\)\."),
        ],
    )
    def test_says_by_how_much_a_limit_is_passed(self, standard_summary, changes, kind, said):
        """Breaks if a limit that is just passed reads as kept, or one far passed in powers of ten."""
        limits = tuple(replace(c, **changes) if c.limit == 265.0 else c for c in standard_summary.limits)
        found = verdict(replace(standard_summary, limits=limits))
        assert found.kind == kind
        assert re.search(said, found.text)

    def test_is_no_plain_pass_where_other_ties_are_worse(self, standard_summary):
        """Breaks if a client reads that limits are kept, and only a table says that free ends override."""
        rows = [
            {"ties": "free", "status": "override", "reason": "at S1-M1 at 0.2 s"},
            {"ties": "stated", "status": "over", "reason": ""},
            {"ties": "tied", "status": "over", "reason": ""},
        ]
        found = verdict(standard_summary, Beside(tuple(rows)).worse)
        assert found.kind == "warn"
        assert found.text.endswith("86 % used. With free ends: override at S1-M1 at 0.2 s.")
        assert Beside(tuple(rows[1:])).worse == []

    def test_never_calls_anything_kept_that_is_not_known(self, standard_summary):
        """Breaks if the sentence of a run without limits, cut off or unstable reads like a pass."""
        none = replace(standard_summary, limits=())
        assert verdict(none).kind == "none"
        cut = replace(standard_summary, status=Status(Kind.TIME_LIMIT), over=False)
        assert verdict(cut).kind == "warn"
        assert "before it was over" in verdict(cut).text
        unstable = replace(standard_summary, status=Status(Kind.UNSTABLE, detail="take a smaller step"))
        assert verdict(unstable) == failed("No number may be used. Unstable: take a smaller step.")
        values = standard_summary.values | {"valid_until_s": 0.2}
        ended = Status(Kind.CURVE_ENDED, ("S1-M1",), "S1-M1 (past the end); not valid after 0.2 s")
        found = verdict(replace(standard_summary, values=values, status=ended))
        assert found == failed(
            "Not valid after 0.2 s, so that no limit can be judged: curve ended at S1-M1 (past the end)."
        )

    def test_a_sweep_counts_its_cases(self, sweep_folder):
        """Breaks if cases that failed or passed a limit are not counted at the head of a sweep."""
        found = page_of_folder(sweep_folder).verdict
        table = trainmj.read_table(sweep_folder)
        over = (table["status"] == "over").sum()
        assert found.kind == "warn"
        assert found.text.startswith(f"{over} of {len(table)} cases end within all limits; ")
        assert f"{(table['status'] == 'refused').sum()} failed" in found.text

    @pytest.mark.parametrize("folder", ["run_folder", "sweep_folder", "study_folder"])
    def test_stands_before_all_sections(self, folder, request):
        html = (request.getfixturevalue(folder) / "report.html").read_text()
        assert head_of(html)[1] is not None
        assert html.index('<p class="whole') < html.index("<nav")


class TestBars:
    def test_have_one_scale_and_a_mark_at_the_limit(self):
        """Breaks if a bar that passes its limit ends before the mark, or bars cannot be compared."""
        section = Page("p").section("s")
        section.bars([Bar("a", 50.0, 100.0), Bar("b", 200.0, 100.0, verdict=failed()), Bar("c", 0.0)], "t", "mm")
        assert [(filled, mark) for _, filled, mark in section.blocks[0].content["rows"]] == [
            ("25.00%", "50.00%"),
            ("100.00%", "50.00%"),
            ("0.00%", None),
        ]

    def test_are_the_strokes_and_energies_of_the_tables(self, standard_result, standard_summary):
        """Breaks if bars say something else than tables, or the capacity is not the area below the curve."""
        page = Page("p")
        section = page.section("s")
        add_used(section, standard_result.chain, standard_summary)
        strokes, energies = ([row[0] for row in block.content["rows"]] for block in section.blocks)
        anti_climber = next(bar for bar in strokes if bar.name == "S1-M1 anti_climber")
        assert (anti_climber.said, anti_climber.verdict) == ("227.2 of 265", passed())
        front = standard_summary.interfaces[0]
        assert energies[0].value == front.energy_kJ
        device = standard_result.chain.interfaces[standard_result.chain.front].devices[0]
        end = next(s.start + s.limit for s in device.stages if s.name == "anti_climber")
        assert energies[0].limit == pytest.approx(device.envelope.energy(end) / KJ)
        assert capacity(device) == device.envelope.energy(end)
        html = page.html()
        assert "227.2 of 265" in html
        assert "one train&#39;s side" in html

    def test_of_a_long_train_those_next_to_the_impact_and_how_many_are_left_out(self, standard):
        changes = {"trains.b_type.vehicles": 12, "simulation.time_limit_s": 0.02}
        result = trainmj.run(standard.with_values(changes))
        section = Page("p").section("s")
        add_used(section, result.chain, trainmj.summarise(result))
        energies = section.blocks[1].content
        assert [row[0].name.split()[0] for row in energies["rows"]] == [
            "S1-M1",
            *(f"M{n}-M{n + 1}" for n in range(1, 8)),
        ]
        assert "4 interfaces further back" in energies["note"]

    def test_none_is_judged_that_is_not_valid(self, standard_result, standard_summary):
        values = standard_summary.values | {"valid_until_s": 0.2}
        section = Page("p").section("s")
        add_used(section, standard_result.chain, replace(standard_summary, values=values))
        assert all(row[0].verdict == failed("not valid") for block in section.blocks for row in block.content["rows"])


def test_the_front_is_one_trains_side_everywhere(standard_result, standard_summary):
    """Breaks if animation, page, figure, table or CSV tell the whole of the front where the others tell a side."""
    from trainmj.single import figures
    from trainmj.single.page_animation import animation_data
    from trainmj.single.page_histories import interface_lines

    front = standard_result.chain.front
    own = standard_summary.interfaces[0].stroke_mm
    drawn = animation_data(standard_result)["devices"][animation_data(standard_result)["front"]]
    line = interface_lines(standard_result, "stroke", 1, [front])[0]
    panel = figures.collision(standard_result).get_axes()[1]
    told = {
        "CSV": standard_result.table()["stroke_S1-M1_mm"].max(),
        "response": standard_summary.responses["stroke_S1_M1_mm"],
        "page": max(line["y"]),
        "figure": panel.lines[0].get_ydata().max(),
        "animation": max(drawn[0]["stroke"]),
        "animation, other side": max(drawn[1]["stroke"]),
    }
    assert told == pytest.approx(dict.fromkeys(told, own), abs=0.05)
    assert standard_result.tally.stroke_max[front] * 1e3 == pytest.approx(2 * own), "which is both sides"
    assert "one train's side" in panel.get_ylabel()


def test_limits_stand_in_the_pictures_of_what_they_limit(standard_result):
    """Breaks if a limit is drawn elsewhere than where it is passed, or one that cannot be is drawn."""
    from trainmj.single.marks import Mark, marks

    front = next(s for s in standard_result.chain.interfaces[-1].devices[0].stages)
    assert front.name == "device"
    found = {mark.name: mark.value for mark in marks(standard_result, "stroke")}
    stages = standard_result.chain.interfaces[standard_result.chain.front].devices[0].stages
    anti_climber = next(s for s in stages if s.name == "anti_climber")
    assert found == {
        "limit of coupler_a_b, coupler_c_d": 418.0,
        "limit of front anti_climber": pytest.approx(anti_climber.start * 1e3 + 265.0),
    }
    assert marks(standard_result, "acceleration") == [Mark("limit of peak device acceleration", 5.0, both=True)]
    assert marks(standard_result, "force") == [
        Mark("car body gives way behind front, coupler_a_b, coupler_c_d", 2000.0)
    ]
    assert marks(standard_result, "energy") == []
    stated = standard_result.scenario.with_values({"limits.stroke_S1_M1_anti_climber_mm": 100.0})
    assert 100.0 not in [
        m.value for m in marks(trainmj.run(stated.with_values({"simulation.time_limit_s": 0.01})), "stroke")
    ]


def test_limits_of_the_vertical_plane_are_drawn_too():
    from trainmj.single.marks import marks

    changes = {"simulation.time_limit_s": 0.01, "limits.wheel_lift_mm": 20.0, "limits.pitch_mrad": 5.0}
    result = trainmj.run(planar(changes))
    assert [(m.value, m.both) for h in ("lift", "pitch") for m in marks(result, h)] == [(20.0, False), (5.0, True)]
