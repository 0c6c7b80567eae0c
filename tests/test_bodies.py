"""Bodies that give: beside formulas, beside rigid vehicles, and as the quantities that come from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import few

from trainmj.collision.batch import run_chains
from trainmj.collision.body import Body, Bogies, plastic_over
from trainmj.collision.lineup import line_up
from trainmj.collision.remarks import remarks
from trainmj.collision.saved import load_result
from trainmj.collision.simulation import run
from trainmj.collision.stability import is_stable, largest_step
from trainmj.collision.summary import summarise
from trainmj.errors import InputError
from trainmj.scenario import Scenario, load
from trainmj.single.tables import why_not_valid
from trainmj.units import KN_PER_MM, G
from trainmj.verification import bodies
from trainmj.verification.systems import Ride, chain, envelope

BODY = "trains.b_type.body"
STIFF = {"stiffness_kN_per_mm": 1000}
TUBE = envelope([(0, 0), (10, 600), (2000, 600)], 60.0)


def b_type(body, name="b_type", **values):
    return load(name, {BODY: body, "simulation.step_ms": 0.05} | values)


def strokes(summary):
    return {i.name: i.stroke_mm for i in summary.interfaces}


@pytest.mark.parametrize("case", bodies.CASES, ids=lambda case: case.__name__)
def test_bodies_follow_formulas(case):
    """Breaks if waves, frequencies, damping, collapse or the largest step of a body are not what mechanics says."""
    missed = [check for check in case() if not check.passed]
    assert not missed


def test_a_rigid_body_is_no_body():
    """Breaks if a vehicle that states it is rigid is computed otherwise than one that states nothing."""
    plain, rigid = run(load("b_type")), run(load("b_type", {BODY: "rigid"}))
    assert not rigid.chain.members
    for name, values in plain.numbers().items():
        assert values.tobytes() == rigid.numbers()[name].tobytes(), name


LAWS = {  # against rigid vehicles: front, M1-M2, M2-M3, S2-S3 [mm]; speeds of both trains at 0.85 s [km/h]
    ("b_type_scenario_1", 200): (-37.7, 38.0, -3.0, -3.3, 11.48, 13.06),
    ("b_type_scenario_1", 500): (-12.5, 8.0, 4.2, 4.0, 11.80, 12.73),
    ("b_type_scenario_1", 1000): (-2.8, -1.5, 3.9, 3.8, 11.86, 12.67),
    ("b_type_scenario_1", 2000): (-2.8, 1.0, 1.3, 1.2, 11.91, 12.62),
    ("b_type_scenario_2", 500): (-8.3, 0.5, 5.8, 5.6, 6.83, 7.71),
    ("b_type_scenario_2", 1000): (-4.2, 0.3, 3.0, 3.0, 6.94, 7.59),
}
"""Measured with another program, which shares no code with this one."""


@pytest.mark.parametrize(("name", "stiffness"), few(LAWS, 3))
def test_bodies_change_the_strokes_of_table_2_as_another_program_has_it(name, stiffness):
    """Breaks if members, or where devices attach, are not those of a bar: 0.5 mm and 0.03 km/h."""
    *expected, moving, struck = LAWS[name, stiffness]
    rigid = strokes(summarise(run(load(name))))
    result = run(b_type({"stiffness_kN_per_mm": stiffness}, name))
    summary = summarise(result)
    given = strokes(summary)
    changes = {i: given[i] - rigid[i] for i in rigid}
    assert [changes[i] for i in ("S1-M1", "M1-M2", "M2-M3", "S2-S3")] == pytest.approx(expected, abs=0.5)
    assert abs(changes["S1-S2"] - changes["M1-M2"]) < 0.8
    others = [abs(change) for i, change in changes.items() if i not in ("S1-M1", "M1-M2", "M2-M3", "S2-S3", "S1-S2")]
    assert max(others) < {200: 2.7, 500: 1.3, 1000: 1.0, 2000: 0.7}[stiffness]
    n, coasting = result.chain.n_moving, 0.008 * G * (0.85 - result.time[-1])
    assert abs(coasting) < 0.03
    assert (result.velocity[-1][:n].mean() - coasting) * 3.6 == pytest.approx(moving, abs=0.03)
    assert (result.velocity[-1][n:].mean() - coasting) * 3.6 == pytest.approx(struck, abs=0.03)
    assert abs(summary.balance.energy_error) < 1e-5
    assert abs(summary.balance.momentum_error) < 1e-9


def test_four_members_are_enough():
    """Breaks if what a body does depends on how finely it is cut."""
    four, eight = (summarise(run(b_type(STIFF | {"members": n}, "b_type_scenario_1"))) for n in (4, 8))
    assert [i.stroke_mm for i in four.interfaces] == pytest.approx([i.stroke_mm for i in eight.interfaces], abs=0.5)


def test_three_ways_to_state_one_body():
    """Breaks if EA or the first frequency means another stiffness: k = EA / L, f = sqrt(k / M) / 2."""
    frequency = 0.5 * np.sqrt(1e9 / 33e3)
    bodies_of = [
        line_up(b_type(body)).vehicles[0].body
        for body in (STIFF, {"EA_MN": 20_000}, {"frequency_Hz": float(frequency)})
    ]
    assert [body.stiffness for body in bodies_of] == pytest.approx([1e9] * 3, rel=1e-12)


def test_batches_and_single_runs_are_the_same_bits():
    """Breaks if points or members of one simulation of a batch are laid out or reset otherwise than in a single run."""
    cases = [
        line_up(b_type(body, "b_type_wall", **{"mass_t": mass}))
        for body in (STIFF, STIFF | {"members": 1}, STIFF | {"collapse_force_kN": 900, "hardening_kN_per_mm": 3})
        for mass in (30, 36)
    ]
    alone = [summarise(run(_of(case.vehicles[0].body, case.vehicles[0].mass))) for case in cases]
    for threads, places in ((1, 2), (2, 128)):
        found = dict(run_chains(enumerate(cases), threads, places))
        for k, single in enumerate(alone):
            assert repr(found[k].responses) == repr(single.responses)
            assert repr(found[k].vehicles) == repr(single.vehicles)


def _of(body, mass):
    stated = STIFF | {"members": body.n_members}
    if body.collapse < np.inf:
        stated |= {"collapse_force_kN": 900, "hardening_kN_per_mm": 3}
    return b_type(stated, "b_type_wall", mass_t=mass / 1e3)


def test_a_vehicle_is_judged_by_its_centre_of_mass():
    """Breaks if speeds, positions or peaks of a vehicle are those of one of its points."""
    result = run(b_type(STIFF | {"bogies": {"mass_t": 6, "centres_m": 12}}, "b_type_wall"))
    chain = result.chain
    assert len(chain.points) == 7 * len(chain.vehicles)
    for i, vehicle in enumerate(chain.vehicles):
        part = chain.points_of(i)
        weights = chain.point_mass[part] / vehicle.mass
        assert weights.sum() == pytest.approx(1.0, rel=1e-14)
        for name in ("position", "velocity", "acceleration"):
            mean = getattr(result, f"point_{name}")[:, part] @ weights
            assert getattr(result, name)[:, i] == pytest.approx(mean, rel=1e-12, abs=1e-12)
    assert result.tally.speed == pytest.approx(result.velocity[-1], rel=1e-12)
    front = result.force[:, chain.front]  # on the first vehicle alone
    behind = result.force[:, chain.front - 1]
    assert np.abs(behind - front).max() / chain.vehicles[-1].mass <= result.tally.device_peak[-1] * (1 + 1e-12)


def test_points_and_members_are_counted_from_the_impact():
    """Breaks if member 1 of a struck vehicle is its far one, or devices are attached at the wrong end of a vehicle."""
    chain = line_up(b_type(STIFF | {"members": 2, "attached_m": [0, 11]}))
    m1, s1 = chain.front, chain.front + 1
    assert [chain.points[k].name for k in chain.points_inward(m1)] == ["M1 1", "M1 2", "M1 3"]
    assert chain.points[chain.points_of(m1).stop - 1].name == "M1 1", "on the right"
    assert chain.points[chain.points_of(s1).start].name == "S1 1", "on the left"
    assert [chain.members[k].name for k in chain.members_inward(m1)] == ["M1 member 1", "M1 member 2"]
    of = {i.name: [chain.points[end].name for end in chain.ends(i)] for i in chain.interfaces}
    assert of["S1-M1"] == ["M1 1", "S1 1"]
    assert of["M1-M2"] == ["M2 1", "M1 2"], "its rear coupler is attached 11 m from the rear end, at its middle"
    turned = line_up(b_type(STIFF | {"members": 2, "attached_m": [0, 11]}, **{"collision.partner_end": "rear"}))
    of = {i.name: [turned.points[end].name for end in turned.ends(i)] for i in turned.interfaces}
    assert of["S1-M1"] == ["M1 1", "S1 2"], "struck at its rear end"


def test_twins_collide_as_one_train_with_a_wall():
    """Breaks if bodies of the moving and of the struck train are not mirror images: without rail friction."""
    body = STIFF | {"members": 3, "attached_m": [1, 8], "collapse_force_kN": 1240, "hardening_kN_per_mm": 3}
    twins = summarise(run(b_type(body, **{"collision.rail_friction": 0})))
    wall = summarise(run(b_type(body, "b_type_wall", **{"collision.rail_friction": 0, "collision.speed_km_h": 12.5})))
    own = twins.interfaces[: len(wall.interfaces)]
    assert [i.stroke_mm for i in own] == pytest.approx([i.stroke_mm for i in wall.interfaces], abs=1e-6)
    for a, b, c in zip(twins.vehicles[:6], twins.vehicles[6:], wall.vehicles, strict=True):
        assert a.body_plastic_mm == pytest.approx(b.body_plastic_mm, abs=1e-6)
        assert a.body_plastic_mm == pytest.approx(c.body_plastic_mm, abs=1e-6)
        assert a.body_peak_g == pytest.approx(b.body_peak_g, rel=1e-6)
    assert wall.vehicles[0].collapsed


@pytest.mark.parametrize("bogies", [None, Bogies(5e3, 500 * KN_PER_MM, 1e4, 12.0)])
def test_a_body_coasts_to_a_stop_as_one_mass_does(bogies):
    """Breaks if rail friction on points or bogies is not that of the whole vehicle, or does not hold what stands."""
    speed, mu = 2.0, 0.1
    case = chain([33e3], [TUBE], [speed], friction=mu, step=1e-4, gap=100.0)
    body = Body(1000 * KN_PER_MM, damping_ratio=0.05, n_members=4, bogies=bogies)
    case = replace(case, vehicles=(replace(case.vehicles[0], body=body),))
    assert case.friction.sum() == pytest.approx(mu * 33e3 * G)
    ride = Ride(case).go(1.1 * speed / (mu * G))
    stopped = case.of_vehicles(ride.data.qpos - case.start)[0]
    assert stopped == pytest.approx(speed**2 / (2 * mu * G), rel=1e-4)
    assert case.of_vehicles(ride.go(0.5).data.qpos - case.start)[0] == pytest.approx(stopped, abs=1e-4)
    assert ride.tally.friction_work[0] == pytest.approx(0.5 * 33e3 * speed**2, rel=1e-4)


def test_brakes_and_grade_act_on_the_whole_vehicle():
    """Breaks if points share out a brake, its bound by adhesion or a grade to more or less than the whole."""
    changes = {
        "collision.grade_per_mille": 10,
        "trains.b_type.brakes": {"force_kN": 30, "adhesion": 0.05},
        "collision.gap_mm": 1000,
        "simulation.time_limit_s": 0.2,
    }
    rigid = run(load("b_type_wall", changes))
    for body in (STIFF, STIFF | {"bogies": {"mass_t": 6, "centres_m": 12}}):
        given = run(b_type(body, "b_type_wall", **changes))
        for name in ("friction_work", "brake_work", "grade_work"):
            assert getattr(given.tally, name) == pytest.approx(getattr(rigid.tally, name), rel=1e-3), name


def test_a_body_that_collapses_says_so_above_a_millimetre():
    """Breaks if a collapsed body is no matter, or waves that add up for a moment count as collapse."""
    weak = summarise(run(b_type(STIFF | {"collapse_force_kN": 900, "hardening_kN_per_mm": 3}, "b_type_wall")))
    first = weak.vehicles[0]
    assert str(weak.status).startswith("stroke exhausted at")
    assert "body of M1" in weak.status.where
    assert first.body_plastic_mm > 10.0
    assert first.body_plastic_mm == pytest.approx(sum(m.plastic_mm for m in first.members))
    assert first.body_plastic_5m_mm <= first.body_plastic_mm * (1 + 1e-12)
    assert first.body_shortening_mm >= first.body_plastic_mm
    strong = summarise(run(b_type(STIFF | {"collapse_force_kN": 1900}, "b_type_wall")))
    assert 0.0 < sum(v.body_plastic_mm for v in strong.vehicles) < 1.0, "waves add up beyond the collapse force"
    assert "body" not in str(strong.status)


def test_a_body_that_is_drawn_out_says_so_too():
    """Breaks if a body that yields in tension is no matter: its devices push at its far end."""
    pulled = STIFF | {"collapse_force_kN": 500, "hardening_kN_per_mm": 3, "attached_m": [20, 0]}
    summary = summarise(run(b_type("rigid", "b_type_wall", **{"trains.b_type.vehicles.0.body": pulled})))
    assert summary.vehicles[0].body_plastic_mm < -1.0
    assert "body of M1 (drawn out by " in summary.status.reason


def test_a_member_of_which_nothing_is_left_is_not_valid():
    """Breaks if a body of 20 m is crushed by 70 m and only the stroke is exhausted."""
    soft = STIFF | {"members": 2, "collapse_force_kN": 60}
    changes = {"collision.speed_km_h": 60, "simulation.time_limit_s": 1.2, "trains.b_type.vehicles.0.body": soft}
    result = run(b_type("rigid", "b_type_wall", **changes))
    summary = summarise(result)
    member = result.chain.members_inward(result.chain.front)[0]
    until = np.argmax(result.member_shortening[:, member] >= 10.0) * result.chain.record_interval
    assert until - result.chain.record_interval < summary.valid_until_s <= until
    assert summary.status.where == ("body of M1",)
    assert summary.status.unusable
    assert "body of M1 was shortened by its whole length" in why_not_valid(summary)
    assert "draw gear" not in why_not_valid(summary)


def test_a_response_that_only_bodies_have_is_missed_with_the_reason():
    """Breaks if the names of all other responses are listed instead."""
    for name in ("body_plastic_mm", "body_plastic_M1_mm", "plastic_M1_member_1_mm", "peak_acceleration_M1_2_g"):
        with pytest.raises(InputError, match=r"; no vehicle of the scenario has a body that gives$"):
            line_up(load("b_type", {f"limits.{name}": 5}))


def test_what_to_know_of_a_body_that_collapses_is_said():
    """Breaks if a car body that stands twice, or a collapse that stays in one member, is computed in silence."""
    said = " ".join(remarks(line_up(b_type(STIFF | {"collapse_force_kN": 2000}))))
    assert "coupler_a_b, coupler_c_d, front: a car body stands behind" in said
    assert "without hardening" in said
    hard = STIFF | {"collapse_force_kN": 2000, "hardening_kN_per_mm": 2}
    assert "without hardening" not in " ".join(remarks(line_up(b_type(hard))))
    assert "body" not in " ".join(remarks(line_up(b_type(STIFF))))


def test_no_member_carries_more_than_it_yields_at():
    """Breaks if dashpots add to the force of a body that collapses fast: 20 % of damping at 10 m/s."""
    body = STIFF | {"collapse_force_kN": 900, "hardening_kN_per_mm": 0.5, "damping_ratio": 0.2}
    summary = summarise(run(b_type(body, "b_type_wall", **{"collision.speed_km_h": 36})))
    assert summary.vehicles[0].body_plastic_mm > 100
    for member in summary.vehicles[0].members:
        travelled = (member.peak_force_kN - 900) / (4 * 0.5)
        assert member.peak_force_kN >= 900 * (1 - 1e-9)
        assert travelled <= member.shortening_mm
    assert abs(summary.balance.energy_error) < 2e-4


def test_bodies_swing_on_before_a_collision_is_over():
    """Breaks if a run ends with the last touch: waves that meet later make the largest force of a member."""

    def wagon(mass, stiffness, members):
        body = {"stiffness_kN_per_mm": stiffness, "members": members, "damping_ratio": 0.0}
        return {"vehicles": [{"name": "wagon", "mass_t": mass, "body": body}], "front": "tube"}

    curve = {"stroke_mm": [0, 8, 3000], "force_kN": [0, 1330, 1330]}
    values = {
        "devices": {"tube": {"curve": curve, "stiffness_kN_per_mm": 177}},
        "trains": {"a": wagon(33, 85, 2), "b": wagon(62, 444, 4)},
        "collision": {"train": "a", "partner": "b", "speed_km_h": 11.8},
        "simulation": {"step_ms": 0.05},
    }
    result = run(Scenario.from_values(values))
    chain, tally = result.chain, result.tally
    slowest = 1.0 / chain.vehicles[0].body.frequency(33e3)
    assert tally.over
    assert chain.linger == pytest.approx(2 * slowest)
    assert tally.time - tally.last_force_time[0] == pytest.approx(2 * slowest, abs=2e-3)
    later = Ride(chain).go(tally.time + 0.5).tally
    assert tally.last_force_time == later.last_force_time, "nothing touches again"
    touching = Ride(chain).go(float(tally.last_force_time[0])).tally
    assert (touching.member_force_max / later.member_force_max).min() < 0.85
    assert (tally.member_force_max / later.member_force_max).min() > 0.96


def test_plastic_shortening_within_a_length():
    """Breaks if 5 m are taken at the edges of members only, or a short body is not taken as a whole."""
    four = [(0.0, 5.0), (5.0, 10.0), (10.0, 15.0), (15.0, 20.0)]
    assert plastic_over(four, [0.1, 0.0, 0.3, 0.2], 5.0) == pytest.approx(0.3)
    two = [(0.0, 8.0), (8.0, 16.0)]
    assert plastic_over(two, [0.08, 0.16], 5.0) == pytest.approx(0.1), "5 of the 8 m of a member"
    assert plastic_over(two, [0.08, 0.16], 10.0) == pytest.approx(0.16 + 0.02), "across an edge"
    assert plastic_over(two, [0.08, 0.16], 100.0) == pytest.approx(0.24)


def test_a_result_with_bodies_is_saved_and_read(tmp_path):
    """Breaks if points or members are lost on the way to a file, or a file with bodies is refused."""
    scenario = b_type(STIFF | {"bogies": {"mass_t": 6, "centres_m": 12}}, "b_type_wall")
    result = run(scenario)
    result.save(tmp_path / "result.nc")
    again = load_result(tmp_path / "result.nc")
    assert again.numbers().keys() == result.numbers().keys()
    assert "member_plastic" in again.numbers()
    for name, values in result.numbers().items():
        assert np.array_equal(values, again.numbers()[name]), name
    assert summarise(again).responses == summarise(result).responses
    assert list(result.dataset().member.values[:2]) == ["M6 member 4", "M6 member 3"]


def test_a_step_that_is_too_large_for_the_members_is_refused():
    """Breaks if the bound is that of the devices alone, or far from what is stable."""
    with pytest.raises(InputError, match=r"step_ms = 0.2: must be at most 0\.146 ms .* bodies"):
        line_up(load("b_type", {BODY: STIFF, "simulation.step_ms": 0.2}))
    limit = largest_step(line_up(b_type(STIFF))) * 1e3
    assert 0.146 < limit < 0.147
    case = line_up(b_type(STIFF, "b_type_wall"))
    limit = largest_step(case)
    steps = [(part, replace(case, step=part * limit, steps_per_record=7)) for part in (0.98, 1.05)]
    found = {part: summary.status.kind.value for part, summary in run_chains(steps)}
    assert found == {0.98: "over", 1.05: "unstable"}


@pytest.mark.parametrize("body", [STIFF, {**STIFF, "bogies": {"mass_t": 6, "centres_m": 12}}])
def test_what_is_refused_is_what_eigenvalues_refuse(body):
    """Elimination tells it at once; breaks if it lets pass a step that is too large, or asks too often."""
    for name in ("b_type", "b_type_wall"):
        case = line_up(b_type(body, name))
        limit = largest_step(case)
        for part, stable in ((0.5, True), (1.0 - 1e-7, True), (1.0, True), (1.0 + 1e-7, False), (1.5, False)):
            assert is_stable(replace(case, step=part * limit)) is stable, (name, part)


def test_quantities_of_bodies_are_there_where_a_body_gives():
    """Breaks if columns of bodies stand in the tables of rigid trains, or are missing where one vehicle gives."""
    rigid = summarise(run(load("b_type_wall")))
    assert not any(name.startswith("body_") or "member" in name for name in rigid.responses)
    one = load("b_type_wall", {"trains.b_type.vehicles.0.body": STIFF, "simulation.step_ms": 0.05})
    mixed = summarise(run(one))
    assert mixed.responses["body_shortening_M1_mm"] > 0.5
    assert mixed.responses["body_shortening_M2_mm"] == 0.0
    assert mixed.responses["body_peak_M2_g"] == mixed.vehicles[1].peak_acceleration_g
    assert mixed.responses["shortening_M1_member_1_mm"] == mixed.vehicles[0].members[0].shortening_mm
    assert mixed.responses["peak_acceleration_M1_1_g"] == mixed.vehicles[0].points[0].peak_acceleration_g
    assert not mixed.vehicles[1].members
    limited = summarise(run(one.with_values({"limits": {"body_shortening_mm": 0.1, "plastic_M1_member_2_mm": 5}})))
    assert [(c.name, c.where, c.kept) for c in limited.limits if c.of_scenario] == [
        ("body_shortening_mm", "M1", False),
        ("plastic_M1_member_2_mm", "", True),
    ]


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ({"members": 4}, "needs stiffness_kN_per_mm, EA_MN or frequency_Hz"),
        (STIFF | {"EA_MN": 3}, "does not go with stiffness_kN_per_mm"),
        ("soft", "must be rigid, or a group with stiffness_kN_per_mm, EA_MN or frequency_Hz"),
        (STIFF | {"members": 0}, "must be at least 1"),
        (STIFF | {"damping_ratio": 2}, "divide by 100 if it is in %"),
        (STIFF | {"bogies": {"mass_t": 17, "centres_m": 12}}, "leaves -1 t of 33 t for the body"),
        (STIFF | {"bogies": {"mass_t": 5, "centres_m": 30}}, r"at most the length of the vehicle \(20 m\)"),
        (STIFF | {"attached_m": [12, 9]}, r"at most the length of the vehicle together \(20 m\)"),
        (STIFF | {"hardening_kN_per_mm": 1}, "needs collapse_force_kN"),
        ({"stiffness_kN_per_mm": 1_000_000}, "divide by 1000 if it is in N/mm"),
    ],
)
def test_a_wrong_body_is_refused_with_a_cure(body, said):
    with pytest.raises(InputError, match=said):
        b_type(body)
