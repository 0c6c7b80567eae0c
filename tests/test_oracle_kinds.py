"""Every kind of device against solutions by other means: formulas, and scipy's integrators on the plain values."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise

import numpy as np
import pytest
from builders import few

from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.scenario import Scenario, load
from trainmj.verification import kinds, oracles
from trainmj.verification.kinds import Exact
from trainmj.verification.mixed import random_scenario, with_bodies
from trainmj.verification.oracle import Solution, solve
from trainmj.verification.oracle.bodies import Member, Members

CASES = list(kinds.cases())


def front(names) -> str:
    return next(name for name in names if name in ("S1-M1", "M1-wall"))


def of_solution(found: Solution, quantity: str) -> float:
    """A quantity of an exact case, in the oracle's solution."""
    what, where = quantity.split()
    first = front(found.interfaces)
    if what == "speed_m_s":
        return found.speed[where]
    if what == "travel_m":
        return found.travel[where]
    if what == "stands_s":
        return found.stood[where]
    if where == "all":
        return sum(i.absorbed for i in found.interfaces.values()) / 1e3
    if where in ("moving", "struck"):
        return found.interfaces[first].sides[where == "struck"] * 1e3
    at = found.interfaces[first if where == "front" else where]
    return {"stroke_mm": at.stroke * 1e3, "force_kN": at.force / 1e3, "pull_kN": at.pull / 1e3, "time_s": at.time}[what]


@cache
def solved(name: str) -> Solution:
    values = next(case.values for case in CASES if case.name == name)
    return solve(values, values["simulation"]["time_limit_s"])


LONG = ("Brake that rises", "Brake after a delay, downhill")
"""They roll for 20 s. Brakes are among the random trains below, and test_exact.py holds runs against these numbers."""


@pytest.mark.thorough
@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=f"{case.name}: {case.quantity}", marks=[pytest.mark.thorough] * (case.name in LONG))
        for case in CASES
    ],
)
def test_the_oracle_gives_the_exact_numbers(case: Exact):
    """Breaks when the oracle has a wrong law or loses a switch: 1e-6 of every formula."""
    found = solved(case.name)
    assert of_solution(found, case.quantity) == pytest.approx(case.exact, rel=1e-6, abs=1e-9)
    assert abs(found.missing) <= 1e-6 * found.convertible


# the digits that the formulas are known by, to half a unit of the last one
@pytest.mark.parametrize(
    ("name", "quantity", "digits"),
    [
        ("Hysteresis, from zero force", "stroke_mm front", "89.4427"),
        ("Hysteresis, from zero force", "speed_m_s M1", "-0.5547002"),
        ("Hysteresis, from zero force", "lost_kJ all", "27.692308"),
        ("Hydraulic buffer, constant orifice", "speed_m_s M1", "0.75"),
        ("Hydraulic buffer, constant orifice", "stroke_mm front", "1386.2944"),
        ("Two plateaus in series", "stroke_mm front", "1425.65"),
        ("Two plateaus in series", "stroke_mm moving", "300.2"),
        ("Two plateaus in series", "stroke_mm struck", "1125.45"),
        ("Shear-off in series with a spring", "stroke_mm front", "169.28"),
        ("Shear-off in series with a spring", "lost_kJ all", "114.5"),
        ("Shear-off in series with a spring, after it", "speed_m_s M1", "1.9328735"),
        ("Draw gear that breaks", "lost_kJ all", "3.6"),
        ("Car body behind a tube", "stroke_mm front", "1251.32"),
        ("Brake after a delay, downhill", "stands_s M1", "19.914127"),
        ("Brake after a delay, downhill", "travel_m M1", "203.99481"),
        ("Brake that rises", "stands_s M1", "21.25"),
        ("Brake that rises", "travel_m M1", "224.90625"),
        ("Standing wagon on 10 per mille", "speed_m_s S1", "-0.19613"),
    ],
)
def test_formulas_give_the_known_digits(name, quantity, digits):
    """Breaks when a formula of the table is changed."""
    exact = next(case.exact for case in CASES if (case.name, case.quantity) == (name, quantity))
    assert f"{exact:.{len(digits.partition('.')[2])}f}" == digits


def test_ideal_formulas_give_the_known_digits():
    """Breaks when the formulas without ramps, which the exact cases are built on, are changed."""
    assert kinds.rate_ideal(20.0, 1) == pytest.approx((1.5125583, 0.3243721), abs=5e-8)
    assert kinds.rate_ideal(50.0, 2) == pytest.approx((1.4775572, 0.3102942), abs=5e-8)
    assert kinds.preload_ideal() == pytest.approx((0.7630282, 0.6866864), abs=5e-8)
    stroke, force = kinds.gas_ideal(50e3, 0.12, 1.3, 0.5 * 40e3 * 0.8**2)
    assert stroke * 1e3 == pytest.approx(96.93066, abs=5e-6)
    assert force / 1e3 == pytest.approx(426.540, abs=5e-4)
    table = next(case.values["devices"]["buffer"]["metering"] for case in CASES if "metered" in case.name)
    assert table["orifice_kN_s2_per_m2"][0] * 1.0**2 == pytest.approx(200.0)
    assert table["orifice_kN_s2_per_m2"][0] * 5.0**2 == pytest.approx(5000.0)


def test_lorry_and_a_rigid_front_give_the_known_digits():
    """Breaks when the obstacle's formula changes; a front of 1000 kN/mm takes 0.3 to 0.5 % of the stroke."""
    for mass, speed, stroke in ((129.0, 110.0, 2065.969), (129.0, 60.0, 765.635), (198.0, 25.0, 323.421)):
        (case,) = kinds.obstacle(mass, speed, stiff=1e18)
        assert case.exact == pytest.approx(stroke, abs=5e-4)


@pytest.mark.parametrize(("C", "P"), [(20.0, 1), (50.0, 2)])
def test_a_stiff_device_comes_near_the_ideal_one(C, P):
    """Breaks when the exact form of a finite stiffness does not tend to the ideal one."""
    ideal = kinds.rate_ideal(C, P)
    stroke, time = (case.exact for case in kinds.rate(C, P, k=1e14))
    assert (stroke / 1e3, time) == pytest.approx(ideal, rel=1e-5)


# against runs


def compared(scenario: Scenario) -> None:
    """Every check of a run against the oracle passes."""
    checks = list(oracles.beside("", [scenario]))
    assert [check for check in checks if not check.passed] == []
    assert len(checks) == 6


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["b_type", "wagon_80t"])
def test_the_oracle_agrees_with_shipped_trains(name):
    """Breaks when staged devices, unequal fronts or rail friction are read otherwise than the package does."""
    compared(load(name, {"simulation.step_ms": 0.01}))


@pytest.mark.parametrize("seed", few(oracles.SEEDS_OF_EVERY_KIND[:-3:-1], 1))
def test_random_trains_of_every_kind(seed):
    """Breaks when the package and the oracle disagree about a kind of device, an end, a brake or a grade."""
    compared(Scenario.from_values(random_scenario(seed)))


TOO_STIFF = {8, 15, 43}
"""Seeds that take the oracle more than 30 s of computing, in stretches for its implicit integrator: a pair in series of
which a force depends on the rate, or a buffer that holds a preload. Other seeds take their place."""


@pytest.mark.parametrize("seed", sorted(TOO_STIFF))
def test_seeds_that_are_too_stiff_close_their_own_balance(seed):
    """Breaks when a run loses energy where the oracle cannot follow."""
    assert abs(summarise(run(Scenario.from_values(random_scenario(seed)))).balance.energy_error) < 1e-4


MANY = sorted(set(range(53)) - TOO_STIFF)
REACH = [0, 3, 11, 12, 20, 23, 25, 27, 32, 39, 42, 44, 45, 46, 47, 48]
"""Those of the many that have what all of them have, and take a quarter of the time."""


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """All of the many with ``--random-trains 50``."""
    every = metafunc.config.getoption("--random-trains") >= 50
    for name, many, some in (("any_seed", MANY, REACH), ("any_seed_of_bodies", MANY_BODIES, REACH_BODIES)):
        if name in metafunc.fixturenames:
            metafunc.parametrize(name, many if every else some)


def had(seed: int) -> set[tuple[object, ...]]:
    """What the train of a seed has: kinds in series, keys and ends of each kind, partners, signs."""
    values = random_scenario(seed)
    devices, collision = values["devices"], values["collision"]
    fronts, pairs = [], []
    found: set[tuple[object, ...]] = set()
    for train in values["trains"].values():
        fronts.append(train["front"])
        found |= {("brakes", key, bool(value)) for key, value in train.get("brakes", {}).items()}
        for car, behind in pairwise(train["vehicles"]):
            ends = car.get("coupler") or [car["rear"], behind["front"]]
            pairs.append(("coupler", ends if isinstance(ends, list) else [ends, ends]))
            found |= {("car", key, isinstance(value, list)) for key, value in car.items()}
    for obstacle in values.get("obstacles", {}).values():
        fronts.append(obstacle["front"])
        found |= {("obstacle", key, bool(value)) for key, value in obstacle.items()}
    for place, names in (*pairs, ("front", [fronts[0], fronts[-1]])):
        two = [devices[name] for name in names]
        found.add((place, *sorted(map(_kind, two))))
        for device in two:
            end = device.get("beyond", "")
            found.add((_kind(device), "ends", end if isinstance(end, str) else end["kind"]))
            found |= {(_kind(device), key, bool(value)) for key, value in device.items()}
    found |= {(key, collision.get(key)) for key in ("partner", "train_end", "partner_end")}
    signs = ("gap_mm", "rail_friction", "grade_per_mille", "partner_speed_km_h")
    return found | {(key, float(np.sign(collision.get(key, 0.0)))) for key in signs}


def _kind(device: dict) -> str:
    return device.get("kind") or next((key for key in ("stages", "rate") if key in device), "crush")


def test_few_seeds_have_what_many_have():
    """Breaks when a kind, an end or a pair is no longer held against the independent solution."""
    assert set().union(*map(had, REACH)) >= set().union(*map(had, MANY))
    assert set().union(*map(had_of_bodies, REACH_BODIES)) >= set().union(*map(had_of_bodies, MANY_BODIES))


@pytest.mark.thorough
def test_many_random_trains_of_every_kind(any_seed):
    """Breaks as the few do, for what they do not reach."""
    compared(Scenario.from_values(random_scenario(any_seed)))


@pytest.mark.parametrize("seed", few([24, 41, 32, 34, 40, 44], 2))
def test_the_oracle_keeps_its_own_balance(seed):
    """Breaks when the oracle loses energy at a switch, a jump of a joint or a break, or a device of it makes some."""
    found = solve(random_scenario(seed))
    assert abs(found.missing) <= 1e-4 * found.convertible
    assert all(min(i.energies.values()) >= -1e-3 * found.convertible for i in found.interfaces.values())
    assert np.isfinite(list(found.speed.values())).all()


def test_the_same_seed_is_the_same_scenario():
    """Breaks when a scenario depends on more than its seed."""
    assert random_scenario(7) == random_scenario(7)
    assert random_scenario(7) != random_scenario(8)
    assert with_bodies(random_scenario(7), 7) == with_bodies(random_scenario(7), 7)


# bodies that give


def test_the_oracle_swings_as_masses_and_springs():
    """Breaks when the oracle puts a mass, a spring, a bogie or a device elsewhere than a body states."""
    body = {"stiffness_kN_per_mm": 100, "members": 2, "damping_ratio": 0, "attached_m": [7, 0]}
    body["bogies"] = {"mass_t": 5, "centres_m": 15, "stiffness_kN_per_mm": 200}
    tube = {"curve": {"stroke_mm": [0, 400], "force_kN": [0, 20_000]}, "stiffness_kN_per_mm": 50, "beyond": "hold"}
    car = {"name": "car", "mass_t": 40, "length_m": 16, "body": body}
    values = {
        "devices": {"tube": tube},
        "trains": {"a": {"vehicles": [car], "front": "tube"}},
        "collision": {"train": "a", "partner": "rigid_wall", "speed_km_h": 7.2},
    }
    found = solve(values, 0.03)
    mass = np.array([7.5, 15, 7.5, 5, 5]) * 1e3  # rear, middle, front, bogies below rear and front
    stiffness = np.zeros((5, 5))
    stiffness[1, 1] = 50e6  # the tube, at the middle
    for i, j, k in ((0, 1, 200e6), (1, 2, 200e6), (0, 3, 200e6), (2, 4, 200e6)):
        stiffness[[i, j], [i, j]] += k
        stiffness[[i, j], [j, i]] -= k
    root = np.sqrt(mass)
    square, modes = np.linalg.eigh(stiffness / np.outer(root, root))
    omega, start = np.sqrt(square), modes.T @ (root * 2.0)
    place = modes @ (np.sin(omega * 0.03) / omega * start) / root
    speed = modes @ (np.cos(omega * 0.03) * start) / root
    assert found.travel["M1"] == pytest.approx((mass * place).sum() / 40e3, rel=1e-8)
    assert found.speed["M1"] == pytest.approx((mass * speed).sum() / 40e3, rel=1e-8)
    assert found.kinetic[1] == pytest.approx(0.5 * (mass * speed**2).sum(), rel=1e-8)
    bogie = 0.5 * 200e6 * (place[2] - place[4]) ** 2
    assert found.members["M1 bogie 1"].elastic == pytest.approx(bogie, rel=1e-7)


def test_the_oracle_yields_to_and_fro():
    """Breaks when a member of the oracle does not yield in tension too, or hardens otherwise than by its travel."""
    members = Members((Member("", 0, 1, 1e8, collapse=1e6, h=1e7),))
    stroke, plastic_now = 0.0, np.zeros(1)
    for turn in (0.05, -0.05, 0.02):
        rate = np.array([np.sign(turn - stroke)])
        for u in np.linspace(stroke, turn, 2001)[1:]:
            now = np.array([u]), rate, plastic_now
            members.switch(*now)
            plastic_now = plastic_now + members.rate(*now) * abs(turn - stroke) / 2000
        stroke = turn
    (found,) = members.found(np.array([stroke]), plastic_now, np.zeros(1))
    # each way: k (u - p) = F + h travel
    plastic, travel = 0.0, 0.0
    for u in (0.05, -0.05, 0.02):
        more = (abs(1e8 * (u - plastic)) - 1e6 - 1e7 * travel) / 1.1e8
        plastic, travel = plastic + np.sign(u - plastic) * more, travel + more
    assert found.plastic == pytest.approx(plastic, rel=5e-3), "a step is 0.05 mm"
    assert found.lost == pytest.approx(1e6 * travel + 0.5e7 * travel**2, rel=5e-3)


@pytest.mark.parametrize("seed", few([24, 47], 1))
def test_random_trains_with_bodies(seed):
    """Breaks when the package and the oracle disagree about masses, members, yielding, bogies or where devices act."""
    compared(oracles.scenario_of_bodies(seed))


SLOW_OR_LOST = {0, 8, 9, 14, 15, 36, 43}
"""Seeds with bodies that take the oracle minutes, or at which it finds no branch of a pair or a plunger."""


MANY_BODIES = sorted(set(range(0, 53, 2)) - SLOW_OR_LOST)
REACH_BODIES = [10, 20, 24, 26, 28, 30, 32, 34, 40, 46, 48, 50]
"""Those of the many whose bodies have what those of all have, and take a fifth of the time."""


def had_of_bodies(seed: int) -> set[tuple[object, ...]]:
    """What bodies of a seed have: numbers of members, keys, pairs of keys."""
    found: set[tuple[object, ...]] = set()
    for train in with_bodies(random_scenario(seed), seed)["trains"].values():
        for body in (part["body"] for part in (train, *train["vehicles"]) if "body" in part):
            if body == "rigid":
                found.add(("rigid",))
            else:
                found |= {("members", body["members"]), *combinations(sorted(body), 2)}
                found |= {(key, bool(value)) for key, value in body.items()}
    return found


@pytest.mark.thorough
def test_many_random_trains_with_bodies(any_seed_of_bodies):
    """Breaks as the few do, for what they do not reach."""
    compared(oracles.scenario_of_bodies(any_seed_of_bodies))


@pytest.mark.thorough
def test_random_trains_with_bodies_are_the_same_in_batches_and_with_smaller_steps():
    """Breaks if points or members of many sizes are laid out otherwise in a batch, or steps that are made smaller."""
    chains = {}
    for seed in (3, 5, 24, 31, 34, 47):
        chain = line_up(oracles.scenario_of_bodies(seed))
        chains |= {(seed, refined): replace(chain, refined=refined, time_limit=0.1) for refined in (False, True)}
    together = dict(run_chains(chains.items(), 2, 3))
    for key, chain in chains.items():
        (alone,) = (summary for _, summary in run_chains([(key, chain)], 1, 1))
        assert repr(together[key].responses) == repr(alone.responses), key
        assert repr(together[key].balance) == repr(alone.balance), key
