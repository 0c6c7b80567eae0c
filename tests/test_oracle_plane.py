"""The independent solution in the vertical plane against geometry, formulas, and what must be conserved."""

from __future__ import annotations

import math

import numpy as np
import pytest

from trainmj.verification.mixed import random_train
from trainmj.verification.oracle import plane, solve
from trainmj.verification.oracle.gear import PITCH, Gears, Z

BOGIES = {"centres_m": 12.6, "wheelbase_m": 2.3, "frame_t": 2.56, "frame_pitch_t_m2": 1.75, "wheelset_t": 1.42}
HEIGHTS = {"axle_height_m": 0.42, "link_height_m": 0.6, "cog_height_m": 0.5}
SECONDARY = {"kN_per_mm": 0.7, "kN_s_per_m": 60, "lift_stop_mm": 60, "bump_stop_mm": 60, "stop_kN_per_mm": 20}
PRIMARY = {"kN_per_mm": 3.4, "kN_s_per_m": 20, "lift_stop_mm": "none", "bump_stop_mm": 40, "stop_kN_per_mm": 20}
TYPE = {
    "body": {"pitch_inertia_t_m2": 750, "cog_height_m": 1.6, "cog_x_m": 0.7},
    "bogies": {**BOGIES, **HEIGHTS},
    "secondary": SECONDARY,
    "primary": PRIMARY,
}


def pair(ties="stated", vehicles=1, shear=1000, friction=0.2, **collision):
    """Two trains whose fronts are a strut up to a shear-off and faces behind it."""
    strut = {"acts": "strut", "height_mm": 660, "pin_m": 1.5, "swing": {"free_mrad": 20, "MN_m_per_rad": 2}}
    face = {"acts": "face", "height_mm": 950, "overlap_mm": 120}
    face |= {"tie": {"friction": friction, "tooth_kN": 0, "kN_per_mm": 100}}
    coupler = {"curve": {"stroke_mm": [0, 5, 60], "force_kN": [0, 300, 700]}, "line": strut}
    climber = {"curve": {"stroke_mm": [0, 5, 1000], "force_kN": [0, 900, 1200]}, "line": face, "empty_stroke_mm": 5}
    law = {"stiffness_kN_per_mm": 150, "damping_kN_s_per_m": 20}
    fronts = [{"stages": {"a": coupler | {"shear_off": {"force_kN": f}}, "b": climber}, **law} for f in (shear, 1000)]
    inner = {"curve": {"stroke_mm": [0, 10, 800], "force_kN": [0, 400, 700]}, "beyond": "hold", "line": strut, **law}
    cars = [{"name": f"car {k}", "mass_t": 33.0, "type": "tc"} for k in range(vehicles)]
    trains = {name: {"vehicles": cars, "coupler": "inner", "front": f"front {name}"} for name in "ab"}
    return {
        "plane": "vertical",
        "ties": ties,
        "vehicle_types": {"tc": TYPE},
        "devices": {"front a": fronts[0], "front b": fronts[1], "inner": inner},
        "trains": trains,
        "collision": {"train": "a", "partner": "b", "speed_km_h": 72.0, **collision},
    }


def gears(pitch=0.0, **changed) -> Gears:
    """One vehicle 10 mm higher than designed."""
    return Gears([{**TYPE, **changed, "offset_m": 0.01, "pitch_rad": pitch}], [33e3], [1.0])


def test_links_and_axles_stay_on_the_verticals_of_what_carries_them():
    """Breaks when a link leaves the body's own vertical through its bogie, or a wheelset that of its frame."""
    one = gears(bogies={**BOGIES, **HEIGHTS, "cog_height_m": 0.6})  # frames' centres of gravity are at the links
    q = np.random.default_rng(1).uniform(-0.2, 0.2, (1, 11))
    (x,), (z,) = one.places(q, np.zeros(1))
    for b, arm in enumerate((-6.3 - 0.7, 6.3 - 0.7)):
        link, axles = 1 + 3 * b, (2 + 3 * b, 3 + 3 * b)
        theta, phi = q[0, PITCH], q[0, 5 + b]
        assert (x[link] - x[0]) * math.cos(theta) + (z[link] - z[0]) * math.sin(theta) == pytest.approx(arm, abs=1e-12)
        for axle, e in zip(axles, (-1.15, 1.15), strict=True):
            along = (x[axle] - x[link]) * math.cos(phi) + (z[axle] - z[link]) * math.sin(phi)
            assert along == pytest.approx(e, abs=1e-12)


def test_speeds_and_accelerations_are_derivatives_of_places():
    """Breaks when a hand-made derivative is wrong, or a term that the rates alone make is lost."""
    one, rng = gears(), np.random.default_rng(2)
    q, v = rng.uniform(-0.2, 0.2, (1, 11)), rng.uniform(-1.0, 1.0, (1, 11))
    places, d = [one.places(q + h * v, np.zeros(1)) for h in (-1e-4, 0.0, 1e-4)], 1e-4
    for k, speed in enumerate(one.speeds(q, v)):
        assert speed == pytest.approx((places[2][k] - places[0][k]) / (2 * d), abs=1e-7)
    _, c = one.along(one.pose(q), v)
    assert c == pytest.approx((places[2][0] - 2 * places[1][0] + places[0][0]) / d**2, abs=1e-5)


def test_what_no_force_acts_on_keeps_its_kinetic_energy():
    """Breaks when the mass matrix is not that of the kinetic energy, or rates alone change this energy."""
    one, rng = gears(), np.random.default_rng(4)
    q, v = rng.uniform(-0.2, 0.2, (1, 11)), rng.uniform(-1.0, 1.0, (1, 11))
    J, c = one.along(one.pose(q), v)
    mass = one.mass_matrix(q, J)[0]
    assert 0.5 * v[0] @ mass @ v[0] == pytest.approx(one.kinetic(q, v), rel=1e-12)
    assert mass == pytest.approx(mass.T)
    d, rate = 1e-5, np.linalg.solve(mass, one.turning(q, v, J, c)[0])
    change = one.kinetic(q + d * v, v + d * rate) - one.kinetic(q - d * v, v - d * rate)
    assert abs(change) / (2 * d) < 1e-4 * abs(one.turning(q, v, J, c)[0] @ v[0])


def test_rails_hold_at_their_level():
    """Breaks when friction and brakes act elsewhere than at rail level, on a vehicle that turns as one piece."""
    one = gears()
    turn = np.zeros((1, 11))
    turn[0, [PITCH, 5, 6]] = 1.0
    turn[0, [3, 4]] = one.a[0]
    turn[0, 7:] = np.repeat(one.a[0], 2) + one.e[0]
    q = np.zeros((1, 11))
    pulled = one.held(one.along(one.pose(q), q)[0])
    assert (pulled * turn).sum() == pytest.approx(1.6 + 0.01, rel=1e-12)


def test_forces_are_slopes_of_energies():
    """Breaks when a spring, stop, preload or weight pushes otherwise than its energy says."""
    one = gears(pitch=0.002)
    q = np.random.default_rng(3).uniform(-0.1, 0.1, (1, 11))
    force, lost = one.suspended(one.pose(q), q, np.zeros((1, 11)))
    slopes = [(one.potential(q + h, rails=False) - one.potential(q - h, rails=False)) / 2e-6 for h in 1e-6 * np.eye(11)]
    assert force[0] == pytest.approx(-np.array(slopes), rel=1e-5, abs=10.0)
    assert lost == 0.0


def test_small_swings_have_the_frequencies_of_masses_on_springs():
    """Breaks when a spring, mass or lever is another one than stated."""
    level = {**BOGIES, "axle_height_m": 1.6, "link_height_m": 1.6, "cog_height_m": 1.6}
    one = gears(bogies=level, body={**TYPE["body"], "cog_x_m": 0.0})
    free = [Z, PITCH, 3, 4, 5, 6]
    stiffness, d = np.zeros((6, 6)), 1e-6
    for k, j in enumerate(free):
        q = np.zeros((1, 11))
        q[0, j] = d
        stiffness[:, k] = -one.suspended(one.pose(q), q, q * 0)[0][0, free] / d
    J, _ = one.along(one.pose(np.zeros((1, 11))), np.zeros((1, 11)))
    mass = one.mass_matrix(np.zeros((1, 11)), J)[0][np.ix_(free, free)]
    found = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
    k, p, body = 0.7e6, 3.4e6, 33e3 - 2 * 2560 - 4 * 1420
    known = [p * 2.3**2 / 2 / 1750] * 2
    for m, lever in ((body, 1.0), (750e3, 6.3)):  # heave, pitch: a body on two springs on two frames on four springs
        a = np.array([[2 * k * lever**2 / m, -2 * k * lever / m], [-k * lever / 2560, (k + 2 * p) / 2560]])
        known += np.linalg.eigvals(a).tolist()
    assert found == pytest.approx(np.sort(known), rel=1e-6)


def test_what_stands_rests():
    """Breaks when preloads do not hold a vehicle at its pitch, or an offset presses wheels into the rail."""
    values = pair(gap_mm=50.0, offset_mm={"M": 40, "S1": -5}, pitch_mrad={"M1": 3, "S1": -1}) | {}
    values["collision"]["speed_km_h"] = 0.0
    motion = plane.PlaneMotion(values)
    assert np.abs(motion.rate(0.0, motion.y)).max() < 1e-9
    assert motion.of(motion.y)[0][:, PITCH].tolist() == [0.003, 0.001]
    assert motion.gears.load.sum(axis=1) == pytest.approx(33e3 * 9.80665)


@pytest.fixture(scope="module")
def floating() -> plane.InPlane:
    """Without gravity and rails, until the faces have met."""
    return plane.solve(pair(offset_mm={"M": 80}, pitch_mrad={"M": 2}), 0.03, gravity=False, rails=False)


def test_a_floating_pair_keeps_its_momenta(floating):
    """Breaks when a device, tie or swing stop pushes one vehicle otherwise than the other, or off its line."""
    front = floating.interfaces["S1-M1"]
    assert min(path.force for path in front.paths) > 5e5
    assert front.paths[1].tie > 5e3
    assert abs(floating.pitch[-1, 0] - 2e-3) > 1e-4
    for start, end in zip(*floating.momenta, strict=True):
        assert end == pytest.approx(start, abs=1e-6 * floating.momenta[0][0])


def test_energies_balance(floating):
    """Breaks when work of a device, tie, damper, stop, rail or brake goes another way than its force."""
    assert abs(floating.missing) < 1e-6 * floating.kinetic[0]
    found = plane.solve(pair(offset_mm={"M": 80}, rail_friction=0.02, grade_per_mille=20), 0.02)
    assert abs(found.missing) < 1e-6 * found.kinetic[0]


@pytest.mark.thorough
@pytest.mark.parametrize("shear", [1000, 1050])
def test_vehicles_that_only_move_along_are_those_of_one_dimension(shear):
    """Breaks when paths of a device begin, shear off or share a stroke otherwise than in one dimension."""
    values = pair(vehicles=2, shear=shear)
    found, known = plane.solve(values, 0.03, locked=True), solve(values, 0.03)
    for name, ends in found.interfaces.items():
        there = known.interfaces[name]
        assert max(path.closing for path in ends.paths) == pytest.approx(there.stroke, rel=1e-5, abs=1e-8)
        work = sum(path.work for path in ends.paths)
        assert work == pytest.approx(there.absorbed + there.energies["elastic"], rel=1e-4, abs=1.0)
    assert found.interfaces["S1-M1"].paths[1].force > 9e5
    assert list(found.speed.values()) == pytest.approx(list(known.speed.values()), rel=1e-4)


@pytest.mark.thorough
def test_ties_hold_as_much_as_stated(floating):
    """Breaks when a tie carries more than its friction, or acts where ties are off, or slips where it must not."""
    slack = {"offset_mm": {"M": 80}, "pitch_mrad": {"M": 2}, "friction": 1e-3}
    free, stated, tied = (
        plane.solve(pair(ties, **slack), 0.03, gravity=False, rails=False).interfaces["S1-M1"].paths[1]
        for ties in ("free", "stated", "tied")
    )
    assert free.tie == 0.0
    assert stated.tie == pytest.approx(1e-3 * stated.force, rel=0.02)
    assert tied.tie > 2e-3 * tied.force


def test_the_same_seed_is_the_same_train():
    """Breaks when a random train depends on more than its seed."""
    assert random_train(7) == random_train(7)
    assert random_train(7) != random_train(8)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [5])
def test_random_trains_balance_and_have_converged(seed, monkeypatch):
    """Breaks when tolerances, the longest step or the creep of friction leave more than a tenth of what is compared."""
    found = plane.solve(random_train(seed), 0.3)
    monkeypatch.setattr(plane, "CREEP", plane.CREEP / 2)
    for key, part in (("rtol", 10), ("atol", 10), ("longest", 2), ("longest_free", 2)):
        monkeypatch.setattr(plane.PlaneMotion, key, getattr(plane.PlaneMotion, key) / part)
    finer = plane.solve(random_train(seed), 0.3)
    assert abs(found.missing) < 1e-5 * found.kinetic[0]
    for name, ends in found.interfaces.items():
        other = finer.interfaces[name]
        assert ends.step == pytest.approx(other.step, rel=1e-3, nan_ok=True)
        closing = [path.closing for path in ends.paths]
        assert closing == pytest.approx([path.closing for path in other.paths], rel=1e-4, abs=1e-6)
    for name, vehicle in found.vehicles.items():
        assert vehicle.pitch == pytest.approx(finer.vehicles[name].pitch, rel=1e-3)
        assert vehicle.load == pytest.approx(finer.vehicles[name].load, abs=1e-2)
