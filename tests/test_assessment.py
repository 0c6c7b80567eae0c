"""Assessments: is a train judged by every collision that a standard asks of it, and is every number owned up to?"""

from __future__ import annotations

import json
import re

import pytest
import yaml
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.files.provenance import MEANING
from trainmj.files.resources import shipped_files
from trainmj.scenario import Scenario

TRAIN = """
title: Two cars
devices:
  head: { curve: { stroke_mm: [0, 20, 1500], force_kN: [0, 900, 1100] }, stiffness_kN_per_mm: 100, stroke_limit_mm: 1400, beyond: car_body }
  tail: { curve: { stroke_mm: [0, 20, 900], force_kN: [0, 800, 1000] }, stiffness_kN_per_mm: 100, stroke_limit_mm: 700, beyond: car_body }
  between: { curve: { stroke_mm: [0, 60, 500], force_kN: [0, 900, 900] }, stiffness_kN_per_mm: 200, beyond: car_body }
trains:
  shuttle:
    front: head
    rear: tail
    coupler: between
    mass_t: 38
    load: { seats: 60, share: 0.3, kg: 80 }
    vehicles:
      - { name: A }
      - { name: B, mass_t: 41, load: { seats: 80, share: 0.1 } }
collision: { train: shuttle, speed_km_h: 20, partner: rigid_wall, rail_friction: 0.005 }
"""  # noqa: E501

ASKED = """
title: House rules
load_states:
  full: { share: 1 }
  empty: { share: 0 }
limits: { mean_deceleration_g: 5, TS_mm: 3000 }
reported: [mean_120ms_g]
scenarios:
  twin: { title: Into a twin, partner: identical, speed_km_h: 25 }
  lorry: { title: Into a lorry, partner: obstacle_15t, speed_km_h: 50, ends: [front], limits: { TS_mm: null } }
not_computed: { noise: not a matter of collisions }
sources: { limits.TS_mm: our own }
"""


@pytest.fixture(scope="module")
def train(tmp_path_factory) -> Scenario:
    file = tmp_path_factory.mktemp("train") / "shuttle.yaml"
    file.write_text(TRAIN)
    return trainmj.load(file)


@pytest.fixture(scope="module")
def standard(tmp_path_factory) -> trainmj.Standard:
    file = tmp_path_factory.mktemp("asked") / "house.assessment.yaml"
    file.write_text(ASKED)
    return trainmj.load_assessment(file)


@pytest.fixture(scope="module")
def found(train, standard) -> trainmj.Assessment:
    return trainmj.assess(train, standard)


# shipped numbers


def numbers(values, path=()):
    """Paths of all numbers in plain values, positions of named entries by their names."""
    if isinstance(values, dict):
        for key, inner in values.items():
            yield from numbers(inner, (*path, str(key)))
    elif isinstance(values, list):
        for n, inner in enumerate(values):
            named = inner.get("name") if isinstance(inner, dict) else None
            yield from numbers(inner, (*path, str(named or n)))
    elif isinstance(values, int | float) and not isinstance(values, bool):
        yield path


FILES = [*shipped_files(".partner.yaml").values(), *shipped_files(".assessment.yaml").values()]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_number_of_a_shipped_file_has_a_mark_and_a_source(file):
    """Breaks when a number of a standard ships without a word on how far it was seen."""
    values = yaml.safe_load(file.read_text())
    sources = values.pop("sources")
    assert all(entry["mark"] in MEANING and len(entry["source"]) > 5 for entry in sources.values())
    for path in numbers(values):
        around = [".".join(path[:n]) for n in range(len(path), 0, -1)]
        assert any(name in sources for name in around), f"{'.'.join(path)} has no source"


def test_shipped_assessments_claim_nothing():
    for file in shipped_files(".assessment.yaml").values():
        values = yaml.safe_load(file.read_text())
        assert values["title"].startswith("After ")
        assert "no statement of compliance" in " ".join(values["notes"].split())
        assert values["edition"]
        assert len(values["not_computed"]) >= 3


@pytest.mark.parametrize(
    ("name", "changes", "energy_kJ"),
    [
        ("wagon_80t", {"curve": 1}, 61.95),  # 105 mm x 1180 kN / 2
        ("regional_129t", {"curve": 3}, 439.625),
        ("obstacle_15t", {"curve": 2}, 4575.0),
    ],
)
def test_curves_of_partners_take_the_energy_of_their_source(name, changes, energy_kJ):
    """Breaks when a point of a partner's curve is mistyped."""
    values = yaml.safe_load(shipped_files(".partner.yaml")[name].read_text())
    (device,) = values["devices"].values()
    u, f = device["curve"]["stroke_mm"], device["curve"]["force_kN"]
    n = changes["curve"]
    area = sum((u[k + 1] - u[k]) * (f[k + 1] + f[k]) / 2000 for k in range(n))
    assert area == pytest.approx(energy_kJ, rel=1e-12)


# the batch


def test_every_case_has_the_numbers_of_a_single_run(train, found):
    """Breaks when a row of the table cannot be made again by the command beside it."""
    assert len(found.outcomes) == 2 * 2 + 2
    for outcome in found.outcomes:
        single = trainmj.summarise(trainmj.run(train.with_values(outcome.case.changes)))
        assert dict(single.responses) == pytest.approx(dict(outcome.summary.responses), abs=0.0, rel=0.0, nan_ok=True)
        assert str(single.status) == outcome.status


def test_threads_do_not_matter(train, standard, found):
    again = trainmj.assess(train, standard, threads=1)
    assert json.dumps(again.as_dict()) == json.dumps(found.as_dict())


def test_load_states_replace_every_share(found):
    """Breaks when a vehicle with a load of its own keeps its share, so that it is neither full nor empty."""
    masses = {o.case.state: o.case.chain.mass[:2].tolist() for o in found.outcomes if o.case.end == "front"}
    full = [41_000 + 80 * 80, 38_000 + 60 * 80]
    assert masses == {"full": pytest.approx(full), "empty": pytest.approx([41_000, 38_000])}
    rear = next(o for o in found.outcomes if o.case.end == "rear" and o.case.state == "empty")
    assert rear.case.chain.mass.tolist() == pytest.approx([38_000, 41_000, 41_000, 38_000])
    assert rear.case.chain.interfaces[1].devices[0].name == "tail"


def test_a_criterion_is_governed_by_its_worst_case(found):
    for rows in found.governing():
        if rows[0].judged:
            assert rows[0].criterion.used == max(row.criterion.used for row in rows) or not rows[0].criterion.kept
    strokes = {
        (row.outcome.case.end, row.outcome.case.state): row.criterion.found
        for row in found.rows
        if row.outcome.case.key == "twin" and row.criterion.name.startswith("devices.")
    }
    assert len(strokes) == 4


def test_limits_of_a_scenario_replace_those_of_all(found):
    names = {key: {r.criterion.name for r in found.rows if r.outcome.case.key == key} for key in ("twin", "lorry")}
    assert "TS_mm" in names["twin"]
    assert "TS_mm" not in names["lorry"]
    assert all("mean_120ms_g" in of for of in names.values())
    (ts,) = {r.criterion.source for r in found.rows if r.criterion.name == "TS_mm"}
    assert ts == "our own"


def test_only_the_train_is_judged(found):
    """Breaks when the lorry, or what it does, stands among the criteria of the train."""
    of_lorry = [r for r in found.rows if r.outcome.case.key == "lorry"]
    assert of_lorry
    assert not [r for r in of_lorry if "obstacle" in r.criterion.name or r.criterion.where.startswith("S1 ")]


def test_what_is_not_there_is_not_passed_in_silence(train, tmp_path):
    file = tmp_path / "a.assessment.yaml"
    file.write_text(
        "title: A\nlimits: { body_plastic_5m_mm: 50, SIV_760mm_m_per_s: 5 }\n"
        "scenarios: { wall: { title: W, partner: rigid_wall, speed_km_h: 5 } }\n"
        "not_computed: { override: two dimensions }\n"
    )
    found = trainmj.assess(train, file)
    assert found.passed
    assert found.not_computed == {
        "override": "two dimensions",
        "limit of body_plastic_5m_mm": "no vehicle of the scenario has a body that gives",
        "limit of SIV_760mm_m_per_s": "the scenario does not state 760 under occupants.free_flight_mm",
    }


def test_a_case_that_cannot_be_made_is_no_pass(train, tmp_path):
    """Breaks when a train without a device at its rear passes a collision with its rear."""
    bare = train.with_values({"trains.shuttle.rear": None})
    found = trainmj.assess(bare, "cfr238-tier1", "integrated")
    assert not found.passed
    assert any("no device at its rear" in sentence for sentence in found.failed)
    assert [outcome.summary is None for outcome in found.outcomes] == [False, True]


def test_a_collapse_or_an_ended_curve_is_no_pass(train):
    """Breaks when a train passes whose criteria are kept while its car bodies give way."""
    values = train.values()
    for device in values["devices"].values():
        device.pop("stroke_limit_mm", None)
    fast = Scenario.from_values(values)
    found = trainmj.assess(fast, "en15227", "C-I")
    assert not found.passed
    assert any("car bodies gave way" in sentence for sentence in found.failed)
    for device in values["devices"].values():
        device.pop("beyond")
    ended = trainmj.assess(Scenario.from_values(values), "en15227", "C-I")
    assert any("curve ended" in sentence for sentence in ended.failed)
    assert not any(row.criterion.kept for row in ended.rows if "curve ended" in row.outcome.status)


def test_the_line_speed_counts():
    for line, speed in ((None, 110.0), (100, 50.0), (300, 110.0)):
        cases = trainmj.assess("en15227_c1", "en15227", "C-I", line_speed_km_h=line).outcomes
        (found,) = {o.case.changes["collision.speed_km_h"] for o in cases if o.case.key == "deformable_obstacle"}
        assert found == speed
    slow = trainmj.assess("en15227_c1", "en15227", "C-I", line_speed_km_h=50)
    assert not [o for o in slow.outcomes if o.case.key == "deformable_obstacle"], "a line of 50 km/h asks for no 0 km/h"


def test_a_partner_may_stand_beside_the_assessment_file(train, tmp_path):
    (tmp_path / "cart.partner.yaml").write_text(
        "title: Cart\ndevices: { cart_side: { curve: { stroke_mm: [0, 300], force_kN: [0, 900] },"
        " stiffness_kN_per_mm: 50, beyond: stop } }\nobstacle: { mass_t: 2, front: cart_side }\n"
    )
    file = tmp_path / "cart.assessment.yaml"
    file.write_text("title: C\nscenarios: { cart: { title: C, partner: cart, speed_km_h: 30, ends: [rear] } }\n")
    (outcome,) = trainmj.assess(train, file).outcomes
    assert outcome.case.chain.vehicles[-1].mass == 2000
    assert outcome.case.scenario.trains["shuttle"].rear == "tail"


# shipped trains


def test_a_shipped_train_passes_and_one_fails_with_the_reason():
    passes = trainmj.assess("b_type", "en15227", "C-II")
    assert passes.passed
    assert len(passes.not_computed) >= 5
    fails = trainmj.assess("en15227_c1", "en15227", "C-I")
    assert not fails.passed
    assert "stroke of head absorber of S1-M1 (3004.0 of 3000 mm)" in fails.failed[0]


def test_an_obstacle_at_110_km_h_closes_energy_and_momentum():
    """Breaks when the lightest partner at the highest speed leaves the domain of the integration."""
    outcomes = trainmj.assess("en15227_c1", "en15227", "C-I").outcomes
    for outcome in (o for o in outcomes if o.case.key == "deformable_obstacle"):
        assert abs(outcome.summary.balance.energy_error) < 1e-5
        assert abs(outcome.summary.balance.momentum_error) < 1e-9


# the command


def test_the_command_prints_writes_and_ends_with_the_verdict(tmp_path):
    out = tmp_path / "out"
    words = ["assess", "en15227_c1", "--standard", "en15227", "--category", "C-I"]
    done = CliRunner().invoke(main, [*words, "--out", str(out), "--report"])
    assert done.exit_code == 1
    assert max(len(line) for line in done.output.splitlines() if str(out) not in line) <= 80
    for said in ("Not passed", "FAIL", "obstacle deflector", "no statement of compliance", "2008+A1:2010"):
        assert said in done.output
    assert {f.name for f in out.iterdir()} == {
        "assessment.json", "assessment.csv", "report.html", *(f"case_{n}.yaml" for n in range(1, 7)),
    }  # fmt: skip
    spoken = json.loads(CliRunner().invoke(main, [*words, "--json"]).output)
    assert json.loads((out / "assessment.json").read_text()) == spoken
    again = CliRunner().invoke(main, ["run", str(out / "case_5.yaml"), "--json"])
    assert json.loads(again.output)["criteria"]["TS_mm"] == spoken["cases"][4]["responses"]["TS_mm"]
    page = (out / "report.html").read_text(encoding="utf-8")
    for said in ("second-hand", "recalled", "railway-impact-simulator", "obstacle deflector", "2020+A1:2024"):
        assert said in page
    assert CliRunner().invoke(main, ["report", str(out)]).exit_code == 2
    passed = CliRunner().invoke(main, ["assess", "b_type", "--standard", "en15227", "--category", "C-II"])
    assert passed.exit_code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--standard", "en15227"], r"category.*C-II: metro"),
        (["--standard", "en15227", "--category", "C-V"], r"'C-V' is none of its categories"),
        (["--standard", "en1522", "--category", "C-I"], r"no such file or shipped assessment; did you mean 'en15227'"),
        (["--standard", "en15227", "--category", "C-I", "--report"], r"--report: needs --out"),
        (["--standard", "en15227", "--category", "C-I", "--line-speed", "-5"], r"-5"),
    ],
)
def test_wrong_options_are_refused(words, said):
    done = CliRunner().invoke(main, ["assess", "b_type", *words])
    assert done.exit_code == 2
    assert re.search(said, done.output + done.stderr)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "deceleration_g: 5,",
            "decceleration_g: 5,",
            r"house.yaml:6:\d+: limits.mean_decc.*did you mean 'mean_deceleration_g'",
        ),
        ("[mean_120ms_g]", "[mean_120_g]", r"reported.*mean_120_g"),
        ("partner: identical", "partner: wagon_80", r"no train, obstacle or partner file.*did you mean 'wagon_80t'"),
        ("speed_km_h: 25", "speed_by_category_km_h: { C-I: 25 }", r"C-I = 25: there is no category"),
        ("speed_km_h: 25 }", "ends: [front] }", r"needs speed_km_h or speed_by_category_km_h"),
        ("limits.TS_mm: our", "limits.TAMA_g: our", r"sources.limits.TAMA_g.*leads to no value"),
        ("limits.TS_mm: our own", "limits.TS_mm: { mark: seen, source: us }", r"mark = 'seen': must be 'read'"),
        ("share: 0 }", "share: 50 }", r"share = 50: must be at most 10"),
        ("title: House rules", "titel: House rules", r"titel.*did you mean 'title'"),
    ],
)
def test_wrong_files_are_refused_with_place_and_cure(train, tmp_path, old, new, said):
    assert old in ASKED
    file = tmp_path / "house.yaml"
    file.write_text(ASKED.replace(old, new))
    (tmp_path / "train.yaml").write_text(TRAIN)
    done = CliRunner().invoke(main, ["assess", str(tmp_path / "train.yaml"), "--standard", str(file)])
    if "partner file" in said:  # one case of several: the others are computed
        assert done.exit_code == 1
    else:
        assert done.exit_code == 2
    assert "Traceback" not in done.output
    assert re.search(said, " ".join((done.output + done.stderr).split()))
