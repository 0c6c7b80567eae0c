"""Two devices in series: exact splits of the stroke, shear-offs, snaps, and the paths of a front."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders import Alone, built, device, envelope, few, joined

from trainmj.collision.chain import meet
from trainmj.collision.fields import ELEMENT
from trainmj.collision.lineup import line_up
from trainmj.collision.press import press
from trainmj.collision.simulation import run
from trainmj.collision.summary import summarise
from trainmj.scenario import Scenario, load
from trainmj.verification.oracle import solve


def pair(left, right) -> Alone:
    return Alone(meet(device(left), device(right), coupled=False)[0])


def sides(pressed: Alone) -> list[float]:
    """Strokes of both devices [mm]."""
    return [pressed.of(ELEMENT.STROKE, n) * 1e3 for n in range(2)]


def to(pressed: Alone, stroke_mm: float, steps: int = 1) -> float:
    """Press on at rest in some steps; the force [kN]."""
    for u in np.linspace(pressed.stroke, stroke_mm * 1e-3, steps + 1)[1:].tolist():
        pressed.to(u)
    return pressed.force / 1e3


@pytest.mark.parametrize("steps", [1, 7, 1000])
def test_the_weaker_plateau_crushes_first(steps):
    """However large a step is."""
    weak = envelope([(0, 0), (10, 500), (300, 500), (301, 900), (400, 900)], 1000)
    strong = envelope([(0, 0), (10, 700), (100, 700)], 1000)
    pressed, at_500 = pair(weak, strong), 10 * 500 / 700
    assert to(pressed, 200, steps) == pytest.approx(500)
    assert sides(pressed) == pytest.approx([200 - at_500, at_500])
    assert to(pressed, 350, steps) == pytest.approx(700)
    assert sides(pressed)[0] == pytest.approx(300.5)


@pytest.mark.parametrize("swapped", [False, True])
def test_while_one_device_shears_off_the_other_unloads_along_its_stiffness(swapped):
    """It gives back its elastic stroke only, and takes that again before it crushes on."""
    shearing = envelope([(0, 0), (50, 1000), (60, 0), (100, 0), (101, 1500), (500, 1500)], 2000)
    other = envelope([(0, 0), (40, 1200), (400, 1200)], 500)
    pressed = pair(other, shearing) if swapped else pair(shearing, other)
    at_peak = 40 * 1000 / 1200
    assert to(pressed, 50 + at_peak, 10) == pytest.approx(1000)
    assert to(pressed, 60 + at_peak, 50) == 0.0
    crushed = sides(pressed)[0 if swapped else 1]
    assert crushed == pytest.approx(at_peak - 1000 / 500), "the other gives back its elastic stroke only"
    assert to(pressed, 142, 50) == pytest.approx(1200)
    assert sides(pressed)[1 if swapped else 0] == pytest.approx(100.8, abs=1e-3)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("ramp_mm", [0.0, 0.25])
def test_a_bolt_never_shears_below_its_force(swapped, ramp_mm):
    """1260 kN do not shear under 1250 kN, and do under 1270, whatever the step, where the curve drops at once, too."""
    bolt = envelope([(0, 0), (1.26, 1260), (1.26 + ramp_mm, 0), (50, 0)], 1000)
    for most, shears in ((1250, False), (1270, True)):
        plateau = envelope([(0, 0), (10, most), (600, most)], 500)
        for steps in (1, 3, 100):
            pressed = pair(plateau, bolt) if swapped else pair(bolt, plateau)
            to(pressed, 40, steps)
            assert (pressed.force == 0.0) is shears
            assert sides(pressed)[1 if swapped else 0] == pytest.approx(40 - sides(pressed)[0 if swapped else 1])
            assert pressed.of(ELEMENT.PEAK) <= 1260e3 * (1 + 1e-9)


def test_a_snap_loses_what_both_springs_held():
    """Bolts of 1200 kN against 100 kN/mm: 7920 J, of which neither device is worn."""
    bolt = envelope([(0, 0), (1.2, 1200), (1.7, 0), (51.7, 0), (51.7, 1000), (900, 1000)], 1000)
    pressed = pair(bolt, envelope([(0, 0), (50, 5000)], 100))
    to(pressed, 13.1999999, 100)
    assert pressed.force == pytest.approx(1200e3)
    assert pressed.lost == pytest.approx(0.0, abs=1e-3)
    to(pressed, 13.3)
    assert pressed.force == 0.0
    assert pressed.lost == pytest.approx(7920 + 0.5 * 1200e3 * 1e-4, rel=1e-6), "with the work of this last step"
    assert sides(pressed)[1] == pytest.approx(0.0, abs=1e-6), "the spring is as long as it was"


@pytest.mark.parametrize("bolts", [(1200, 1260), (1260, 1200)])
def test_bolts_that_differ_shear_in_the_order_of_their_forces(bolts):
    """Both orders: each side has its own stroke until the stronger one shears as well."""

    def front(bolt: float):
        return envelope([(0, 0), (bolt / 1000, bolt), (bolt / 1000 + 0.5, 0), (20, 0), (22, 3000), (200, 3000)], 1000)

    pressed = pair(front(bolts[0]), front(bolts[1]))
    to(pressed, 10, 100)
    first = int(bolts[1] < bolts[0])
    strokes = sides(pressed)
    assert strokes[first] > 5, "the weaker bolts have sheared"
    assert strokes[1 - first] == pytest.approx(0.0, abs=1e-6), "the others have sprung back, unworn"
    to(pressed, 60, 400)
    assert min(sides(pressed)) > 20, "pressed on, both have sheared"


def test_a_steep_curve_in_series_gives_way_along_its_own_stiffness():
    """5 kN/mm to 2000 kN in series with a spring of 5 kN/mm, whose own curve is out of reach."""
    hard = {"curve": {"stroke_mm": [0, 400], "force_kN": [0, 2000]}, "stiffness_kN_per_mm": 1000}
    soft = {"curve": {"stroke_mm": [0, 20, 400], "force_kN": [0, 2000, 2000]}, "stiffness_kN_per_mm": 5}
    values = {
        "devices": {"hard": hard, "soft": soft},
        "trains": {n: {"mass_t": 30, "front": f, "vehicles": 1} for n, f in (("a", "hard"), ("b", "soft"))},
        "collision": {"train": "a", "speed_km_h": 15, "partner": "b"},
        "simulation": {"step_ms": 0.01},
    }
    for partners in (("a", "b"), ("b", "a")):
        values["collision"] |= {"train": partners[0], "partner": partners[1]}
        summary = summarise(run(Scenario.from_values(values)))
        found = dict(zip(partners, summary.interfaces[:2], strict=True))
        assert [found[n].stroke_mm for n in "ab"] == pytest.approx([161.37, 161.37], abs=0.01)
        assert found["a"].peak_force_kN == pytest.approx(806.87, abs=0.02)
        assert [found[n].permanent_mm for n in "ab"] == pytest.approx([160.57, 0.0], abs=0.02)
        assert [found[n].energy_kJ for n in "ab"] == pytest.approx([64.78, 0.0], abs=0.01)


@pytest.mark.parametrize(
    ("pressed_mm", "swapped"), few([(60.0, False), (110.0, True), (60.0, True), (110.0, False)], 2)
)
def test_a_spring_is_pressed_again_on_a_plunger_that_stays(pressed_mm, swapped):
    """The force of a preload is there or not, and the pair carries what the spring does, whichever side it is on."""
    specs = {
        "spring": {
            "curve": {"stroke_mm": [0, 50, 200], "force_kN": [0, 1000, 1000]},
            "stiffness_kN_per_mm": 20,
            "beyond": "hold",
        },
        "oil": {
            "kind": "hydraulic",
            "stroke_mm": 100,
            "orifice_kN_s2_per_m2": 10,
            "preload_kN": 100,
            "preload_stiffness_kN_per_mm": 100,
            "beyond": {"kind": "stop", "stiffness_kN_per_mm": 100},
        },
    }
    devices = built(**specs)
    left, right = ("oil", "spring") if swapped else ("spring", "oil")
    again = Alone(meet(devices[left], devices[right])[0])
    spring, oil = (1, 0) if swapped else (0, 1)
    rate, step = 1e-3, 1e-4  # m/s, m
    for u in np.arange(step, pressed_mm / 1e3, step):
        again.to(u, rate, step / rate)
    for u in np.arange(again.stroke, 0.02, -step):
        again.to(u, -rate, step / rate)
    assert again.force == 0.0
    plunger, loose = again.of(ELEMENT.STATE_0, oil), again.of(ELEMENT.STATE_0, spring)
    for u in np.arange(again.stroke, plunger + loose + 0.004, step):
        force = again.to(u, rate, step / rate)
        assert force == pytest.approx(20e6 * max(0.0, u - plunger - loose), abs=2.0), f"at {u * 1e3:g} mm"
    laws = again.of(ELEMENT.DISSIPATED, 0) + again.of(ELEMENT.DISSIPATED, 1)
    assert again.lost == pytest.approx(laws, abs=2.0), "no energy is lost or won beside the two laws"


def test_two_draw_gears_that_break_lose_what_both_springs_held():
    """Nothing is left in either spring, and each has lost F^2/2K."""
    tube = {"curve": {"stroke_mm": [0, 50], "force_kN": [0, 1000]}, "stiffness_kN_per_mm": 20}
    devices = built(
        near=tube | {"pull": {"stiffness_kN_per_mm": 50, "slack_mm": 2, "breaking_force_kN": 300}},
        far=tube | {"pull": {"stiffness_kN_per_mm": 30, "slack_mm": 3}},
    )
    drawn = Alone(meet(devices["near"], devices["far"])[1])
    for u in np.arange(0.0, 0.025, 5e-6):
        drawn.to(-u)
    assert drawn.force == 0.0
    springs = [300e3**2 / 2 / k for k in (50e6, 30e6)]
    assert [drawn.of(ELEMENT.DISSIPATED, n) for n in range(2)] == pytest.approx(springs, rel=1e-3)
    assert drawn.lost == pytest.approx(sum(springs), rel=1e-3)
    assert [drawn.of(ELEMENT.FORCE, n) for n in range(2)] == [0.0, 0.0], "or they count as elastic energy at the end"


@pytest.mark.parametrize("step_s", few([5e-5, 5e-6], 1))
def test_bolts_that_resist_the_rate_lose_no_more_than_is_there(step_s):
    """As they fail they give way far faster than the pair closes, and the factor of a rate has no bound."""
    bolts = {
        "stages": {
            "coupler": {
                "curve": {"stroke_mm": [0, 5, 60], "force_kN": [0, 600, 700]},
                "shear_off": {"force_kN": 800, "ramp_mm": 1.0},
            },
            "anti_climber": {"empty_stroke_mm": 20, "curve": {"stroke_mm": [0, 5, 100], "force_kN": [0, 900, 900]}},
        },
        "stiffness_kN_per_mm": 100,
        "damping_kN_s_per_m": 30,
        "rate": {"C_m_per_s": 4, "P": 1},
        "beyond": "hold",
    }
    tube = {
        "curve": {"stroke_mm": [0, 10, 300], "force_kN": [0, 1500, 1600]},
        "stiffness_kN_per_mm": 800,
        "beyond": "hold",
    }
    devices = built(bolts=bolts, tube=tube)
    sheared = Alone(meet(devices["bolts"], devices["tube"])[0])
    rate, work = 3.7, 0.0
    for u in np.arange(rate * step_s, 0.12, rate * step_s):
        before = sheared.force
        work += 0.5 * (before + sheared.to(u, rate, step_s)) * rate * step_s
    assert sheared.lost + sheared.stored == pytest.approx(work, rel=1e-4)
    laws = sheared.of(ELEMENT.DISSIPATED, 0) + sheared.of(ELEMENT.DISSIPATED, 1)
    assert laws < sheared.lost < laws + 0.02 * work, "what is set free beside them is never less than nothing"


def test_paths_of_a_front_meet_at_the_sum_of_their_starts():
    """Breaks if the anti-climber of one side were pressed against the coupler of the other before they meet."""
    other = load("b_type").values()["devices"]["front"]
    other["stages"]["coupler"]["shear_off"]["force_kN"] = 1260.0
    values = load("b_type").values()
    shears = values["devices"]["front"]["stages"]["coupler"]["shear_off"]["force_kN"]
    values["devices"]["stronger"] = other
    values["trains"]["other"] = {**values["trains"]["b_type"], "front": "stronger"}
    values["collision"]["partner"] = "other"
    unequal = line_up(Scenario.from_values(values))
    front = unequal.interfaces[unequal.front]
    _, climber = front.elements
    starts = [device_.stages[1].start for device_ in front.devices]
    assert climber.start == pytest.approx(sum(starts))
    assert shears < 1260.0
    path = press(front, 1.0)
    assert path.force[np.searchsorted(path.stroke, climber.start) - 1] == pytest.approx(0.0, abs=1.0)
    assert path.force.max() == pytest.approx(1260e3, rel=0.05)
    equal = summarise(run(load("b_type"))).interfaces[0]
    both = summarise(run(Scenario.from_values(values))).interfaces[:1]
    assert 2 * equal.stroke_mm == pytest.approx(1204.1, abs=40)
    assert both[0].stroke_mm == pytest.approx(equal.stroke_mm, rel=0.05)


def test_equal_sides_are_one_law_and_unequal_ones_two():
    """A front of two different devices reports both."""
    one, other = envelope([(0, 0), (10, 500), (100, 500)], 100), envelope([(0, 0), (10, 700), (100, 700)], 100)
    assert [len(e.laws) for e in meet(device(one), device(one))] == [1]
    assert [len(e.laws) for e in joined(one, other).elements] == [2]


def random_device(rng: np.random.Generator) -> dict[str, Any]:
    """One whose force rises steeply all the way, so that what swings between two of them moves their strokes little."""
    stroke = np.cumsum([0, rng.uniform(5, 40), *rng.uniform(30, 100, 2)])
    force = np.cumsum([0, rng.uniform(150, 500), *rng.uniform(300, 800, 2)])
    return {
        "curve": {"stroke_mm": stroke.tolist(), "force_kN": force.tolist()},
        "stiffness_kN_per_mm": float(rng.uniform(50, 150)),
        "damping_kN_s_per_m": float(rng.uniform(20, 40)),
        "beyond": "stop",
    }


def by_ends_and_with_plates(seed: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """A train with a device at each inner end against a wall, and the same one with plates of 1 kg between these."""
    rng = np.random.default_rng(seed)
    devices, cars, plates = {"head": random_device(rng)}, [], []
    n = int(rng.integers(2, 4))
    for i in range(n):
        car = {"name": f"car {i + 1}", "mass_t": float(rng.uniform(15, 60))}
        ends = [key for key, inner in (("front", i > 0), ("rear", i < n - 1)) if inner]
        devices |= {f"{end}{i}": random_device(rng) for end in ends}
        cars.append(car | {end: f"{end}{i}" for end in ends})
        plates.append(car | ({"coupler": f"rear{i}"} if "rear" in ends else {}))
        plates += [{"name": "plate", "mass_t": 1e-3, "coupler": f"front{i + 1}"}] if "rear" in ends else []
    values = {
        "devices": devices,
        "collision": {"train": "t", "partner": "rigid_wall", "speed_km_h": float(rng.uniform(8, 20))},
        "simulation": {"step_ms": 0.005, "time_limit_s": 0.25},
    }
    one, other = (values | {"trains": {"t": {"vehicles": v, "front": "head"}}} for v in (cars, plates))
    return one, other


def strokes_beside(seed: int, of_plates: Callable[[dict[str, Any]], dict[str, float]]) -> tuple[list[float], ...]:
    """Strokes [mm] of all devices of a random train, by ends, and by interfaces with plates between them."""
    by_ends, plates = by_ends_and_with_plates(seed)
    found = {i.name: i.stroke_mm for i in summarise(run(Scenario.from_values(by_ends))).interfaces}
    beside = of_plates(plates)
    names = {"M1-wall": "M1-wall"}
    for i in range(1, len(by_ends["trains"]["t"]["vehicles"])):
        names[f"M{i}-M{i + 1} M{i}"] = f"M{2 * i - 1}-M{2 * i}"
        names[f"M{i}-M{i + 1} M{i + 1}"] = f"M{2 * i}-M{2 * i + 1}"
    assert set(names) == set(found)
    return list(found.values()), [beside[names[name]] for name in found]


@pytest.mark.parametrize("seed", few(range(12), 6))
def test_a_device_at_each_end_is_a_chain_with_plates_between_them(seed):
    """Breaks if a device is at another end than stated, or two in series are not what a light plate makes of them."""
    by_ends, plates = strokes_beside(
        seed, lambda v: {i.name: i.stroke_mm for i in summarise(run(Scenario.from_values(v))).interfaces}
    )
    assert by_ends == pytest.approx(plates, rel=1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [0, 4, 5])  # of three and of two vehicles; with stiff plates others take longer
def test_a_device_at_each_end_is_that_chain_by_the_independent_solution(seed):
    """Breaks if both are wrong in the same way: strokes within 0.1 % of those by scipy's integrators."""
    by_ends, plates = strokes_beside(
        seed, lambda v: {name: i.stroke * 1e3 for name, i in solve(v, 0.25).interfaces.items()}
    )
    assert by_ends == pytest.approx(plates, rel=1e-3)
