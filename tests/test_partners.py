"""Partners in files of their own, where values come from, and who is judged."""

from __future__ import annotations

import json
import re

import pytest
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.errors import InputError
from trainmj.files.provenance import CHANGED, Provenance
from trainmj.files.resources import shipped_files
from trainmj.scenario import Scenario, from_yaml, to_yaml

CART = """
title: Cart
sources:
  obstacle.mass_t: { mark: assumed, source: a guess }
  devices.cart_side: drop test of May
devices:
  cart_side: { curve: { file: side.csv }, stiffness_kN_per_mm: 50, beyond: stop, stroke_limit_mm: 40 }
obstacle: { mass_t: 2, front: cart_side }
"""
TRAIN = """
title: Into a cart
builds_on: b_type.yaml
collision: { partner: cart, speed_km_h: 15 }
limits: { TS_mm: 2000 }
sources:
  limits.TS_mm: { mark: read, source: "tender, page 7" }
  devices.front.stages.anti_climber.stroke_limit_mm: drawing 12
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cart.partner.yaml").write_text(CART)
    (tmp_path / "side.csv").write_text("stroke_mm,force_kN\n0,0\n50,900\n")
    (tmp_path / "train.yaml").write_text(TRAIN)
    return tmp_path


def test_a_partner_file_beside_the_scenario_is_taken_over(folder):
    scenario = trainmj.load(folder / "train.yaml")
    assert scenario.obstacles["cart"].mass_t == 2
    assert scenario.devices["cart_side"].curve.force_kN == [0, 900]
    assert scenario.sources["obstacles.cart.mass_t"] == Provenance(mark="assumed", source="a guess")
    assert folder / "side.csv" in scenario.files
    again = from_yaml(to_yaml(scenario))
    assert again.values() == scenario.values(), "what is written is whole, without the partner's file"


def test_a_shipped_partner_is_one_word_away():
    """Breaks when a partner can only be used by copying its devices into the scenario."""
    for name, path in shipped_files(".partner.yaml").items():
        scenario = trainmj.load("b_type", {"collision.partner": name, "collision.speed_km_h": 10})
        summary = trainmj.summarise(trainmj.run(scenario))
        assert not summary.status.unusable, f"{name}: {summary.status}"
        assert abs(summary.balance.energy_error) < 1e-3
        assert CliRunner().invoke(main, ["check", path.name]).exit_code == 0


def test_partners_can_be_varied_in_a_sweep(tmp_path):
    sweep = trainmj.grid_of("b_type", {"collision.partner": ["wagon_80t", "rigid_wall", "b_type"]})
    found = trainmj.run_sweep(sweep, tmp_path)
    assert found.failed == 0
    assert found.cases == 3


def test_a_message_about_a_partner_names_its_file(folder):
    (folder / "cart.partner.yaml").write_text(CART.replace("mass_t: 2,", "mass_t: 2000,"))
    with pytest.raises(InputError, match=r"cart\.partner\.yaml:8:\d+: obstacle\.mass_t = 2000: must be at most 1000"):
        trainmj.load(folder / "train.yaml")
    (folder / "cart.partner.yaml").write_text(CART.replace("stroke_limit_mm: 40", "stroke_limit_mm: 70"))
    with pytest.raises(InputError, match=r"cart\.partner\.yaml:7:\d+: devices\.cart_side\.stroke_limit_mm.*within"):
        trainmj.load(folder / "train.yaml")
    (folder / "cart.partner.yaml").write_text(CART.replace("obstacle:", "obstacel:"))
    with pytest.raises(InputError, match="did you mean 'obstacle'"):
        trainmj.load(folder / "train.yaml")
    (folder / "cart.partner.yaml").write_text(CART.partition("obstacle: {")[0])
    with pytest.raises(InputError, match="must state a train or an obstacle"):
        trainmj.load(folder / "train.yaml")


def test_a_partner_file_is_whole(folder):
    """Breaks when a curve that the file lacks is silently taken from the train that runs into it."""
    (folder / "cart.partner.yaml").write_text(CART.replace("{ file: side.csv }", "buffer"))
    with pytest.raises(InputError, match=r"cart\.partner\.yaml:7.*curve = 'buffer': there is no curve of this name"):
        trainmj.load(folder / "train.yaml")
    (folder / "cart.partner.yaml").write_text(CART.replace("obstacle.mass_t:", "obstacle.mass_kg:"))
    with pytest.raises(InputError, match=r"sources\.obstacle\.mass_kg: leads to no value"):
        trainmj.load(folder / "train.yaml")


def test_a_partner_does_not_replace_what_the_scenario_states(folder):
    """Breaks when a device of the train silently becomes that of a partner with the same name."""
    (folder / "cart.partner.yaml").write_text(CART.replace("cart_side", "front"))
    with pytest.raises(InputError, match=r"devices\.front: there is one of this name in .*cart\.partner\.yaml.*rename"):
        trainmj.load(folder / "train.yaml")
    own = {**trainmj.load("b_type").values(), "obstacles": {"wagon_80t": {"mass_t": 1, "front": "front"}}}
    own["collision"] |= {"partner": "wagon_80t"}
    assert Scenario.from_values(own).obstacles["wagon_80t"].mass_t == 1


def test_partner_files_are_not_sought_outside_the_folder(folder):
    for name in ("../cart", "/etc/passwd", "a b"):
        with pytest.raises(InputError, match="no train, obstacle or partner file"):
            trainmj.load("b_type", {"collision.partner": name})


# sources


def test_sources_stand_beside_their_limits_everywhere(folder, tmp_path):
    file, out = str(folder / "train.yaml"), tmp_path / "out"
    said = CliRunner().invoke(main, ["run", file, "--out", str(out), "--figures", "none", "--report"])
    assert "tender, page 7" in " ".join(said.output.split())
    limits = {c["name"]: c["source"] for c in json.loads((out / "summary.json").read_text())["limits"]}
    assert limits["TS_mm"] == "tender, page 7 (read)"
    assert limits["devices.front.stages.anti_climber.stroke_limit_mm"] == "drawing 12"
    assert limits["mean_deceleration_g"] == "5 g of EN 15227, in Liu et al. 2022; its window is recalled (read)"
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "tender, page 7" in page
    assert "a guess" in page
    assert "a guess" in CliRunner().invoke(main, ["check", file]).output


def test_a_changed_value_does_not_keep_its_source(folder):
    """Breaks when a number that somebody changed still claims to come from the standard."""
    scenario = trainmj.load(folder / "train.yaml")
    inner = scenario.with_values({"devices.cart_side.stiffness_kN_per_mm": 30, "limits.TS_mm": 1500})
    assert inner.sources["devices.cart_side"] == Provenance(mark=CHANGED, source="drop test of May")
    assert inner.sources["limits.TS_mm"] == Provenance(mark=CHANGED, source="tender, page 7 (read)")
    assert inner.sources["obstacles.cart.mass_t"].mark == "assumed"
    again = inner.with_values({"limits.TS_mm": 1400})
    assert again.sources["limits.TS_mm"] == inner.sources["limits.TS_mm"]
    same = scenario.with_values({"limits.TS_mm": 2000})
    assert same.sources == scenario.sources
    gone = scenario.with_values({"limits.TS_mm": None})
    assert "limits.TS_mm" not in gone.sources
    (folder / "over.yaml").write_text("title: Over\nbuilds_on: train.yaml\nlimits: { TS_mm: 1000 }\n")
    assert trainmj.load(folder / "over.yaml").sources["limits.TS_mm"].mark == CHANGED
    (folder / "over.yaml").write_text(
        "title: Over\nbuilds_on: train.yaml\nlimits: { TS_mm: 1000 }\nsources: { limits.TS_mm: tender of June }\n"
    )
    assert trainmj.load(folder / "over.yaml").sources["limits.TS_mm"] == "tender of June"


@pytest.mark.parametrize(
    ("sources", "said"),
    [
        ("{ limits.TSmm: us }", r"sources\.limits\.TSmm = 'us': leads to no value; did you mean 'TS_mm'"),
        ("{ devices.fron: us }", r"sources\.devices\.fron = 'us'.*did you mean 'front'"),
        ("{ limits.TS_mm: { mark: seen, source: us } }", r"mark = 'seen': must be 'read', 'second-hand'"),
        ("{ limits.TS_mm: 5 }", r"must be the source as text, or a group with mark and source"),
        ("{ limits.TS_mm: { mark: read } }", r"source: is missing"),
        ("us", r"sources = 'us': must be a group"),
        ("{ mass_t: us }", r"is a parameter: state the source of the path, trains\.b_type\.mass_t"),
    ],
)
def test_wrong_sources_are_refused(folder, sources, said):
    """Breaks when a source may be stated that no table shows beside its value."""
    (folder / "train.yaml").write_text(re.sub(r"(?s)sources:.*", f"sources: {sources}\n", TRAIN))
    with pytest.raises(InputError, match=said):
        trainmj.load(folder / "train.yaml")


# who is judged


def test_a_partner_past_its_limits_is_said_and_not_judged(folder):
    """Breaks when a train fails because the lorry, or the wagon, that it hits is crushed."""
    scenario = trainmj.load(folder / "train.yaml", {"obstacles.cart.mass_t": 200})
    summary = trainmj.summarise(trainmj.run(scenario))
    partner = next(i for i in summary.interfaces if i.name == "S1-M1 partner")
    assert partner.exhausted
    assert "partner" not in str(summary.status)
    assert not any("cart_side" in c.name for c in summary.limits)
    (said,) = (remark for remark in summary.remarks if "not judged" in remark)
    assert re.search(r"S1-M1 partner \(\d+\.\d of 40 mm\)", said)


def test_the_twin_of_the_train_is_judged(folder):
    """Breaks when the devices of the same train are judged on one side only."""
    sides = {
        side: {"devices.coupler_a_b.stroke_limit_mm": 1.0 + stroke} for side, stroke in (("both", 0.0), ("none", 400.0))
    }
    for side, change in sides.items():
        status = trainmj.summarise(trainmj.run(trainmj.load("b_type", change))).status
        assert ("M1-M2" in str(status)) == ("S1-S2" in str(status)) == (side == "both")


def test_fail_on_limit_heeds_the_train_only(folder):
    file = str(folder / "train.yaml")
    heavy = ["run", file, "--fail-on-limit", "--set", "obstacles.cart.mass_t=200"]
    ended = CliRunner().invoke(main, heavy)
    assert ended.exit_code == 0, ended.output
    assert CliRunner().invoke(main, [*heavy, "--set", "limits.TS_mm=1"]).exit_code == 1
