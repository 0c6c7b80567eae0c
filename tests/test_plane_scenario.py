"""What a scenario states of the vertical plane: read, checked, and lined up as running gear and lines of devices."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from builders import FACE, METRO, STRUT, planar
from jsonschema import Draft202012Validator

import trainmj
from trainmj.collision import simulation
from trainmj.collision.chain import Chain, Element
from trainmj.collision.gear import Gear, Suspension
from trainmj.collision.line import Line, LineEnd
from trainmj.collision.lineup import line_up
from trainmj.collision.measured import Measured
from trainmj.collision.press import press
from trainmj.collision.remarks import remarks
from trainmj.errors import InputError
from trainmj.scenario import Scenario, load, schema
from trainmj.scenario.files import from_yaml, to_yaml
from trainmj.scenario.partners import read_partner
from trainmj.units import G

TYPE, FRONT = "vehicle_types.metro", "devices.front.stages"
COUPLER = LineEnd(strut=True, height=0.66, pin=1.5, free=0.1, swing=2e6)
BOLTS_END = 0.353528  # stroke of the front device at which its bolts have let go [m]
CLIMBER = LineEnd(strut=False, height=0.95, friction=0.2, tie=1e8, overlap=0.12)


@pytest.fixture(scope="module")
def metro() -> Scenario:
    return planar()


def gears(scenario: Scenario) -> dict[str, Gear]:
    return {v.name: v.gear for v in line_up(scenario).vehicles if v.gear is not None}


def front(scenario: Scenario) -> tuple[Element, ...]:
    chain = line_up(scenario)
    return chain.interfaces[chain.front].elements


def near(end: LineEnd) -> Any:
    """An end of a line, up to the round-off of its units."""
    return pytest.approx([getattr(end, f.name) for f in fields(end)], rel=1e-12)


def values(end: LineEnd) -> list[float]:
    return [getattr(end, f.name) for f in fields(end)]


def test_a_vehicle_stands_on_what_its_type_states(metro):
    """A wrong unit or place of a value would move every natural frequency and wheel load."""
    found = gears(metro)
    assert list(found) == [f"M{n}" for n in range(6, 0, -1)] + [f"S{n}" for n in range(1, 7)]
    secondary, primary = Suspension(0.7e6, 6e4, 0.06, 0.06, 2e7), Suspension(3.4e6, 2e4, 0.03, 0.04, 2e7)
    expected = Gear(22_200, 750e3, 1.6, 0, 12.6, 2.3, 2560, 1750, 0.5, 1420, 0.42, 0.6, secondary, primary, 1.2e9, 1e5)
    for f in fields(Gear):
        ours, theirs = getattr(found["M1"], f.name), getattr(expected, f.name)
        pair = [[getattr(s, g.name) for g in fields(s)] if isinstance(s, Suspension) else [s] for s in (ours, theirs)]
        assert pair[0] == pytest.approx(pair[1], rel=1e-12), f.name
    assert found["M1"].mass == pytest.approx(33_000, rel=1e-12)
    assert found["M1"].standing.load == pytest.approx(33_000 * G / 4, rel=1e-12)


def test_a_radius_of_gyration_goes_with_the_mass_of_the_body(metro):
    """Otherwise a loaded vehicle would pitch as an empty one."""
    body = {"radius_of_gyration_m": 5.5, "cog_height_m": 1.6}
    for mass_t in (33, 40):
        gear = gears(metro.with_values({f"{TYPE}.body": body, "mass_t": mass_t}))["M1"]
        assert gear.body_inertia == pytest.approx((mass_t - 10.8) * 1e3 * 5.5**2, rel=1e-12)


def test_stops_may_be_none(metro):
    """A stop that is said not to exist must never act."""
    none = {f"{TYPE}.primary.{key}": value for key, value in (("lift_stop_mm", "none"), ("bump_stop_mm", "none"))}
    primary = gears(metro.with_values(none | {f"{TYPE}.primary.stop_kN_per_mm": None}))["S3"].primary
    assert (primary.lift_stop, primary.bump_stop, primary.stop) == (math.inf, math.inf, 0.0)


@pytest.mark.parametrize(("end", "ahead"), [("front", 1.0), ("rear", -1.0)])
def test_a_centre_of_gravity_turns_with_its_vehicle(metro, end, ahead):
    """The heavier bogie would be at the wrong end of a train that is led by its rear, or of a partner."""
    found = gears(
        metro.with_values({f"{TYPE}.body.cog_x_m": 0.7, "collision.train_end": end, "collision.partner_end": end})
    )
    assert [found["M1"].cog_x, found["S1"].cog_x] == [ahead * 0.7, -ahead * 0.7]


def test_offsets_and_pitches_are_of_a_side_or_of_one_vehicle(metro):
    """Offsets decide whether a train climbs: one that lands on another vehicle makes a wrong verdict."""
    at = {"collision.offset_mm": {"M": 40, "M2": -5, "S1": 3}, "collision.pitch_mrad": {"S": 2, "M1": 1}}
    found = gears(metro.with_values(at))
    offsets = {name: gear.offset for name, gear in found.items() if gear.offset}
    assert offsets == pytest.approx({"M1": 0.04, "M2": -0.005, "S1": 0.003} | {f"M{n}": 0.04 for n in range(3, 7)})
    pitches = {name: gear.pitch for name, gear in found.items() if gear.pitch}
    assert pitches == pytest.approx({"M1": 1e-3} | {f"S{n}": -2e-3 for n in range(1, 7)})  # the struck end up


def test_a_value_of_one_vehicle_is_set_where_none_is_stated_yet(metro):
    """``--set`` and ``--vary`` of an offset would need a file that states it."""
    changed = metro.with_values({"collision.offset_mm.M1": 30})
    assert changed.collision.offset_mm == {"M1": 30}
    assert changed.with_values({"collision.offset_mm.M1": None}).collision.offset_mm == {}


def test_each_path_of_a_device_acts_along_its_own_line(metro):
    """Coupler and anti-climber at one height, or at another stroke than theirs, would pitch the vehicles wrongly."""
    coupler, climber = front(metro)
    assert (coupler.share, coupler.start, climber.share) == (0.5, 0.0, 0.5)
    assert climber.start == pytest.approx(2 * BOLTS_END, rel=1e-12)
    for element, end, shears in ((coupler, COUPLER, True), (climber, CLIMBER, False)):
        assert element.line is not None
        assert (element.line.walled, element.line.inner, element.line.shears) == (False, False, shears)
        assert values(element.line.left) == values(element.line.right) == near(end)


def test_one_device_of_an_interface_stands_for_both_ends(metro):
    """An inner coupler of half the length would swing through twice the angle."""
    chain = line_up(metro)
    (element,) = chain.interfaces[chain.front - 1].elements
    assert element.share == 1.0
    assert element.line == Line(element.line.left, element.line.left, inner=True)
    assert values(element.line.left) == near(COUPLER)


def test_sides_that_differ_act_in_series_along_the_lines_of_both(metro):
    """The left end of a line must be that of the left vehicle."""
    other = metro.values()["devices"]["front"] | {"damping_kN_s_per_m": 40}
    changed = metro.with_values(
        {"devices.other": other, "devices.other.stages.coupler.line.height_mm": 700}
        | {"trains.other": metro.values()["trains"]["b_type"] | {"front": "other"}, "collision.partner": "other"}
    )
    coupler, climber = front(changed)
    assert (coupler.line.left.height, coupler.line.right.height) == pytest.approx((0.66, 0.7))
    assert len(coupler.laws) == len(climber.laws) == 2
    assert climber.starts == pytest.approx((0.375, 0.375))


def test_a_wall_is_met_where_the_train_stands(metro):
    """A wall has no height of its own: a step against it at the start would be made up."""
    at = {"collision.partner": "rigid_wall", "collision.offset_mm.M": 40, "collision.pitch_mrad.M1": 2}
    coupler, climber = front(metro.with_values(at))
    assert (coupler.share, climber.share, climber.start) == pytest.approx((1.0, 1.0, BOLTS_END))
    for element, height in ((coupler, 0.66), (climber, 0.95)):
        assert element.line.walled
        rise = 0.04 + 10 * math.sin(2e-3) + (height - 1.6) * (math.cos(2e-3) - 1)
        assert element.line.right.height - element.line.left.height == pytest.approx(rise, rel=1e-9)
    assert (coupler.line.right.pin, coupler.line.right.swing, climber.line.right.tie) == pytest.approx((0, 0, 1e8))
    begun = simulation.run(metro.with_values(at | {"collision.gap_mm": 0, "simulation.time_limit_s": 0.01}))
    assert abs(begun.step[0, begun.chain.front]) < 1e-9


def test_an_obstacle_slides_level_with_the_line_of_its_device(metro):
    """A lorry that has no bogies has no gear; its own height counts."""
    device = {"curve": {"stroke_mm": [0, 400], "force_kN": [200, 200]}, "stiffness_kN_per_mm": 50, "beyond": "hold"}
    stated = {"devices.side": device | {"line": FACE | {"height_mm": 1200}}, "collision.partner": "lorry"}
    stated |= {"obstacles.lorry": {"mass_t": 15, "front": "side"}, "devices.plain": device | {"line": FACE}}
    chain = line_up(metro.with_values(stated | {"trains.b_type.front": "plain"}))
    assert chain.vehicles[-1].gear is None
    (element,) = chain.interfaces[chain.front].elements
    assert (element.line.left.height, element.line.right.height) == pytest.approx((0.95, 1.2))
    fixed = metro.with_values(
        stated | {"trains.b_type.front": "plain", "obstacles.lorry": {"fixed": True, "front": "side"}}
    )
    (element,) = front(fixed)
    assert element.line.walled
    assert element.line.right.height == 1.2


def test_draw_gear_pulls_along_the_first_line(metro):
    """Drawn along another line, it would lift the vehicle that it holds."""
    chain = line_up(metro.with_values({"devices.coupler_c_d.pull": {"stiffness_kN_per_mm": 50}}))
    push, pull = chain.interfaces[chain.front - 2].elements
    assert (push.sign, pull.sign, pull.line) == (1.0, -1.0, push.line)


@pytest.mark.parametrize(
    ("ties", "friction", "tooth", "tie", "free", "swing"),
    [("free", 0, 0, 0, math.inf, 0), ("stated", 0.2, 0, 1e8, 0.1, 2e6), ("tied", 0.2, math.inf, 1e8, 0, 2e6)],
)
def test_ties_hold_ends_less_or_more_than_stated(metro, ties, friction, tooth, tie, free, swing):
    """The bracket around what nobody knows would not enclose it."""
    coupler, climber = front(metro.with_values({"ties": ties}))
    line = climber.line
    assert (line.friction, line.tooth, line.tie) == pytest.approx((friction, tooth, tie))
    assert (coupler.line.left.free, coupler.line.left.swing) == pytest.approx((free, swing))
    assert line.overlap == pytest.approx(0.12)


def test_none_is_no_tie_and_no_swing_stop(metro):
    """What is said not to be there must not hold."""
    coupler, climber = front(
        metro.with_values({f"{FRONT}.coupler.line.swing": "none", f"{FRONT}.anti_climber.line.tie": "none"})
    )
    assert (coupler.line.left.free, coupler.line.left.swing, climber.line.tie) == (math.inf, 0.0, 0.0)


@pytest.mark.parametrize(("stop", "is_told"), [(19, False), (20, True), ("none", True)])
def test_springs_that_pull_before_their_lift_stop_acts_are_told(metro, stop, is_told):
    """A coil spring goes loose there, so lift-off, which comes early, would be believed."""
    chain = line_up(metro.with_values({"vehicle_types.metro.primary.lift_stop_mm": stop}))
    said = [remark for remark in remarks(chain) if "go loose" in remark]
    gear = chain.vehicles[0].gear
    carried = (gear.body_mass / 4 + gear.frame_mass / 2) * 9.80665  # by each wheelset
    assert carried / gear.primary.stiffness == pytest.approx(0.0197, abs=5e-5)
    assert bool(said) is is_told
    assert all(s.startswith("M1 to M6, S1 to S6: the primary springs") and "by 19.7 mm or" in s for s in said)


def same(ours: Chain, theirs: Chain) -> bool:
    """Whether two chains move along the track by the same elements."""
    return all(
        a.share == b.share and a.start == b.start and a.line is b.line is None and len(a.laws) == len(b.laws)
        and all(one.is_like(other) for one, other in zip(a.laws, b.laws, strict=True))
        for i, j in zip(ours.interfaces, theirs.interfaces, strict=True)
        for a, b in zip(i.elements, j.elements, strict=True)
    )  # fmt: skip


def test_along_the_track_nothing_of_it_has_an_effect_and_a_remark_says_so(metro):
    """Comparing with ``--set plane=line`` would compare with something else than the scenario without the data."""
    chain, bare = line_up(metro.with_values({"plane": "line"})), line_up(load("b_type"))
    assert same(chain, bare)
    assert chain.vehicles == bare.vehicles
    said = "along the track only"
    assert said in " ".join(remarks(chain))
    assert said not in " ".join(remarks(bare) + remarks(line_up(metro)))
    limited = {"plane": "line", "limits.step_mm": 100, "limits.wheel_lift_M1_mm": 20}
    assert line_up(metro.with_values(limited)).limits == bare.limits
    for path, value in (("ties", "free"), ("collision.offset_mm", {"M": 1}), ("bracket", ["free", "tied"])):
        assert said in " ".join(remarks(line_up(load("b_type", {path: value})))), path


@pytest.mark.parametrize("partner", ["b_type", "rigid_wall"])
def test_equal_sides_are_reported_alike_whether_their_paths_are_apart_or_not(metro, partner):
    """Strokes and energies of stages would be those of another path, or of both sides together."""
    level = load("b_type", {"simulation.step_ms": 0.2, "collision.partner": partner})
    apart = line_up(metro.with_values({"simulation.step_ms": 0.2, "collision.partner": partner}))
    found = []
    for chain in (line_up(level), replace(apart, plane=False)):
        result = simulation._run(level, chain)
        sides = Measured.of_one(chain, result.tally, result.time, result.velocity).sides
        energies = [float(sides.stage_energy[0, k]) for k, stage in enumerate(sides.stages) if stage.side == 0]
        assert sum(energies) == pytest.approx(sides.energy[0, 0], rel=1e-12)
        of_front = (sides.stroke, sides.permanent, sides.energy, sides.crush_mm)
        found.append([*(values[0, 0] for values in of_front), *energies])
    np.testing.assert_allclose(*found, rtol=5e-3)
    whole, parted = (press(chain.interfaces[chain.front]) for chain in (line_up(level), apart))
    np.testing.assert_allclose(parted.force, whole.force)
    np.testing.assert_allclose(parted.sides, whole.sides)


def test_single_parts_differ_as_built(metro):
    """A single vehicle on other bogies, or a device at another height, would be that of its kind."""
    soft = METRO | {"secondary": METRO["secondary"] | {"kN_per_mm": 0.5}}
    chain = line_up(
        metro.with_values({"vehicle_types.soft": soft}).with_values(
            {"as_built": {"M2": {"type": "soft"}, "S1-M1 partner": {"stages.anti_climber.line.height_mm": 900}}}
        )
    )
    stiffness = {v.name: v.gear.secondary.stiffness for v in chain.vehicles}
    assert [name for name, value in stiffness.items() if value == 0.5e6] == ["M2"]
    climber = chain.interfaces[chain.front].elements[1]
    assert (climber.line.left.height, climber.line.right.height) == pytest.approx((0.95, 0.9))


PARTNER = """\
title: Tram
devices:
  tram_front:
    curve: {stroke_mm: [0, 30, 400], force_kN: [0, 300, 350]}
    stiffness_kN_per_mm: 50
    beyond: stop
    line: {acts: face, height_mm: 950, overlap_mm: 100, tie: none}
vehicle_types:
  tram_bogies: %s
train: {type: %s, mass_t: 28, vehicles: 1, length_m: 20, front: tram_front}
"""


def test_a_partner_file_states_what_its_vehicles_stand_on(metro, tmp_path):
    """A partner could not be struck in the vertical plane without a copy of its data in every scenario."""
    file = tmp_path / "tram.partner.yaml"
    file.write_text(PARTNER % (METRO, "tram_bogies"))
    (tmp_path / "my.yaml").write_text(to_yaml(metro))
    plain = {"curve": {"stroke_mm": [0, 400], "force_kN": [200, 200]}, "stiffness_kN_per_mm": 50, "beyond": "hold"}
    changes = {"devices.plain": plain | {"line": FACE}, "trains.b_type.front": "plain", "collision.partner": "tram"}
    chain = line_up(load(tmp_path / "my.yaml", changes))
    assert chain.vehicles[-1].gear.body_mass == pytest.approx(17_200)
    file.write_text(PARTNER % (METRO, "tram"))
    with pytest.raises(InputError, match=r"tram\.partner\.yaml.*train\.type = 'tram': there is no type of vehicle"):
        read_partner(file)


def test_a_table_of_vehicles_has_their_types(metro, tmp_path):
    """A train of many vehicles in a spreadsheet could stand on one type only."""
    (tmp_path / "cars.csv").write_text("name,type\nTc,\nMp,heavy\n")
    heavy = METRO | {"bogies": METRO["bogies"] | {"frame_t": 3.0}}
    changed = metro.values()
    changed["vehicle_types"]["heavy"] = heavy
    changed["trains"]["b_type"]["vehicles"] = {"file": "cars.csv"}
    (tmp_path / "my.yaml").write_text(trainmj.files.yaml.as_yaml(changed))
    found = gears(load(tmp_path / "my.yaml"))
    assert [found["M1"].frame_mass, found["M2"].frame_mass] == [2560, 3000]


def test_it_is_written_read_and_known_to_editors(metro):
    """A scenario of the vertical plane could be run once, and not from the file that was written beside its result."""
    whole = metro.with_values(
        {"bracket": ["free", "stated", "tied"], "collision.offset_mm": {"M": 40}, "collision.pitch_mrad": {"M1": 3}}
    )
    assert from_yaml(to_yaml(whole)).model_dump() == whole.model_dump()
    validator = Draft202012Validator(schema())
    assert not list(validator.iter_errors(whole.values()))
    wrong = whole.values()
    wrong["devices"]["front"]["stages"]["coupler"]["line"]["pin_m"] = 1500
    wrong["collision"]["offset_mm"] = {"M": 600}
    assert {str(e.json_path).split(".")[1] for e in validator.iter_errors(wrong)} >= {"devices", "collision"}


NONE = "none"
BODY = {"stiffness_kN_per_mm": 1000}
BAD: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({f"{TYPE}.bogies.wheelbase_m": 0}, ("wheelbase_m = 0", "greater than 0")),
    (
        {f"{TYPE}.bogies.wheelbase_m": 9, f"{TYPE}.bogies.centres_m": 9},
        ("wheelbase_m = 9", "less than the 9 m between"),
    ),
    (
        {f"{TYPE}.bogies.centres_m": 17.8},
        ("trains.b_type.type = 'metro'", "20.1 m apart", "the 20 m of Tc", "length_m"),
    ),
    ({f"{TYPE}.bogies.centres_m": 12_600}, ("at most 40", "in m; divide by 1000")),
    ({f"{TYPE}.body.cog_height_m": 1600}, ("at most 5", "in m; divide by 1000")),
    ({f"{TYPE}.body.cog_height_m": -1}, ("cog_height_m = -1", "greater than 0")),
    ({f"{TYPE}.body.cog_height_m": 0.4}, ("above the axles", "0.42 m")),
    ({f"{TYPE}.body.cog_x_m": -6.3}, ("cog_x_m = -6.3", "between the bogies", "6.3 m", "carries nothing")),
    ({f"{TYPE}.body.radius_of_gyration_m": 5}, ("radius_of_gyration_m = 5", "pitch_inertia_t_m2", "leave one")),
    ({f"{TYPE}.body": {"cog_height_m": 1.6}}, ("needs pitch_inertia_t_m2 or radius_of_gyration_m",)),
    ({f"{TYPE}.body.pitch_inertia_t_m2": 750_000}, ("at most 20000", "t m2; divide by 1000")),
    ({f"{TYPE}.bogies.link_height_m": -0.1}, ("link_height_m = -0.1", "greater than 0")),
    ({f"{TYPE}.bogies.axle_height_m": 0}, ("axle_height_m = 0", "greater than 0")),
    ({f"{TYPE}.bogies.frame_t": 14}, ("type = 'metro'", "leaves -0.68 t of the 33 t of Tc", "have 33.68 t")),
    ({f"{TYPE}.bogies.frame_t": 2560}, ("at most 20", "divide by 1000 if it is in kg")),
    ({f"{TYPE}.secondary.lift_stop_mm": 0}, ("lift_stop_mm = 0", "at least 1", "or state none")),
    ({f"{TYPE}.secondary.bump_stop_mm": 0.06}, ("bump_stop_mm = 0.06", "multiply by 1000 if it is in m")),
    ({f"{TYPE}.primary.lift_stop_mm": "no"}, ("lift_stop_mm = 'no'", "must be a travel in mm, or none")),
    ({f"{TYPE}.primary.lift_stop_mm": None}, ("lift_stop_mm: is missing",)),
    ({f"{TYPE}.primary.stop_kN_per_mm": None}, ("is missing", "lift_stop_mm and bump_stop_mm need a stiffness")),
    ({f"{TYPE}.secondary.kN_per_mm": 700}, ("at most 100", "divide by 1000 if it is in N/mm")),
    ({f"{TYPE}.secondary.kN_per_mm": 0.07}, ("gives way by 1.56 m in its secondary", "more than 1 m")),
    ({f"{TYPE}.primary.kN_per_mm": 0.06}, ("gives way by 1.12 m in its primary",)),
    ({f"{TYPE}.rail": {"kN_per_mm": 1.2e6}}, ("at most 20000", "divide by 1000")),
    ({f"{FRONT}.anti_climber.line.overlap_mm": -1}, ("overlap_mm = -1", "at least 1")),
    ({f"{FRONT}.anti_climber.line.height_mm": 0.95}, ("height_mm = 0.95", "multiply by 1000 if it is in m")),
    ({f"{FRONT}.anti_climber.line.height_mm": 9500}, ("at most 5000", "in mm above the rail")),
    ({f"{FRONT}.anti_climber.line.tie": None}, ("line.tie: is missing",)),
    ({f"{FRONT}.anti_climber.line.tie.friction": 20}, ("at most 1", "divide by 100 if it is in %")),
    ({f"{FRONT}.coupler.line.swing": "no"}, ("must be none, or a group with free_mrad and MN_m_per_rad",)),
    ({f"{FRONT}.coupler.line.pin_m": 1500}, ("at most 10", "divide by 1000")),
    ({f"{FRONT}.coupler.line.pin_m": 9.9, "trains.b_type.length_m": 18}, ("pin_m = 9.9", "half the length of M1, 9 m")),
    ({f"{FRONT}.coupler.line.overlap_mm": 3}, ("belongs to acts face",)),
    ({f"{FRONT}.coupler.line.acts": "rod"}, ("must be 'strut' or 'face'",)),
    ({f"{FRONT}.coupler.line": None}, ("coupler.line: is missing", "acts: strut or acts: face")),
    ({f"{FRONT}.coupler.shear_off": None}, ("anti_climber.line", "must be that of coupler", "along one line")),
    ({"devices.coupler_a_b.line": None}, ("devices.coupler_a_b.line: is missing",)),
    ({"trains.b_type.type": None}, ("trains.b_type: has no type", "one of vehicle_types")),
    ({"trains.b_type.type": "metr"}, ("there is no type of vehicle of this name", "did you mean 'metro'")),
    ({"trains.b_type.body": BODY}, ("trains.b_type.body", "body: rigid, or plane: line")),
    ({"trains.b_type.vehicles.1.body": BODY}, ("trains.b_type.vehicles.1.body", "body: rigid, or plane: line")),
    ({"as_built": {"M2": {"body": BODY}}}, ("as_built.M2.body", "body: rigid, or plane: line")),
    ({"as_built": {"M2": {"type": "x"}}}, ("as_built.M2.type = 'x'", "no type of vehicle")),
    (
        {"as_built": {"S1-M1 partner": {"stages.anti_climber.line": STRUT}}},
        ("S1-M1 partner.stages.anti_climber.line.acts", "is a strut and meets devices.front", "a face"),
    ),
    (
        {"as_built": {"S1-M1": {"stages.coupler.shear_off": None, "stages.anti_climber.line": STRUT}}},
        ("devices.front: has 2 of the lines", "meets as_built.S1-M1, which has 1"),
    ),
    ({"collision.offset_mm.M": 501}, ("offset_mm.M = 501", "at most 500", "in mm")),
    ({"collision.offset_mm.M": -501}, ("at least -500", "in mm")),
    ({"collision.offset_mm.M9": 3}, ("there is no vehicle on bogies of this name",)),
    ({"collision.offset_mm.front": 3}, ("must be a side, M or S, or a single vehicle, such as M1",)),
    ({"collision.pitch_mrad.M1": 101}, ("at most 100", "in mrad")),
    ({"collision.pitch_mrad.S": -10}, ("pitch_mrad.S = -10", "of S1 by 63.1 mm", "smaller pitch")),
    ({"collision.offset_mm.S": 3, "collision.partner": "rigid_wall"}, ("offset_mm.S = 3", "no vehicle on bogies")),
    ({"ties": "tied", f"{FRONT}.coupler.line.swing": NONE}, ("swing = 'none'", "ties: tied", "leave tied out")),
    ({"bracket": ["free", "tied"], f"{FRONT}.anti_climber.line.tie": NONE}, ("tie = 'none'", "leave tied out")),
    ({"bracket": ["free"]}, ("at least 2 entries",)),
    ({"bracket": ["free", "free"]}, ("states free more than once",)),
    ({"ties": "tight"}, ("must be 'free', 'stated' or 'tied'",)),
    ({"plane": "vertikal"}, ("must be 'line' or 'vertical'",)),
    (
        {"collision.partner": "wagon_80t"},
        ("trains.wagon_80t: has no type", "devices.wagon_buffers.line: is missing", "copy the file of such a one"),
    ),
]


@pytest.mark.parametrize(("changes", "said"), BAD, ids=[", ".join(changes) for changes, _ in BAD])
def test_what_cannot_be_is_refused_with_path_value_rule_and_cure(metro, changes, said):
    """A vehicle that cannot stand, or a device without a line, would give numbers that look right."""
    with pytest.raises(InputError) as refused:
        line_up(metro.with_values(changes))
    assert [words for words in said if words not in str(refused.value)] == []


def test_bodies_that_give_and_devices_without_lines_stay_in_a_file_that_moves_along_the_track(metro):
    """``--set plane=line`` would be refused for what only the vertical plane needs."""
    line_up(metro.with_values({"plane": "line", "trains.b_type.body": BODY, f"{FRONT}.coupler.line": None}))
