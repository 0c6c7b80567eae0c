"""The integrator events: devices that are followed through what happens to them within a step."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from builders import KINDS_OF_DEVICE, Alone, built, chain, envelope, few
from click.testing import CliRunner
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_steps import ridden

from trainmj.cli import main
from trainmj.collision.batch import run_chains
from trainmj.collision.chain import EVENTS, meet
from trainmj.collision.convergence import converge
from trainmj.collision.envelope import Envelope
from trainmj.collision.fields import ELEMENT
from trainmj.collision.lineup import line_up
from trainmj.collision.simulation import run
from trainmj.collision.summary import Summary, summarise
from trainmj.errors import InputError
from trainmj.scenario import Scenario, load
from trainmj.units import MM
from trainmj.verification.numerics import CLIMBED, JUMPING, JUMPING_STEPS_MS, stopped, stroke_in_jumps
from trainmj.verification.oracle import solve
from trainmj.verification.oracles import strokes
from trainmj.verification.systems import Ride, random_collision

N = 2000
"""Sub-steps that stand for what happens within a step."""

H = 1e-3
"""A step of an element that is pressed alone [s]."""


@st.composite
def envelopes(draw: st.DrawFn) -> Envelope:
    """Curves of up to six parts that rise, hold, fall, or jump where one is without width; dashpots of any strength."""
    n = draw(st.integers(1, 6))
    part = st.one_of(st.just(0.0), st.floats(0.5, 30.0))
    widths = [draw(st.floats(0.5, 30.0)), *(draw(part) for _ in range(n - 1)), 100.0]
    wide = [widths[0], *(after if before or after else 1.0 for before, after in pairwise(widths))]
    force = [draw(st.floats(0.0, 500.0)), *(draw(st.floats(10.0, 1500.0)) for _ in wide)]
    stroke = np.concatenate([[0.0], np.cumsum(wide) + 1e-3 * np.pi])  # no step ends at a jump by chance
    damping = draw(st.sampled_from([0.0, 0.0, 5.0, 100.0, 3000.0]))
    stiffness = draw(st.floats(20.0, 400.0))
    return Envelope(stroke * MM, np.array(force) * 1e3, stiffness * 1e6, damping * 1e3)


def spring_of(law: Alone, curve: Envelope, stroke: float) -> float:
    """Energy in the spring of a law at a stroke [J]."""
    return 0.5 * curve.stiffness * max(0.0, stroke - law.of(ELEMENT.STATE_0)) ** 2


@pytest.mark.thorough
@settings(max_examples=15)
@given(envelopes(), st.lists(st.floats(-12.0, 20.0), min_size=1, max_size=4))
@example(envelope([(0, 300), (40, 300), (40, 800), (90, 200)], 60), [19.0, 3.5, 10.0, -4.0])  # ends as it climbs
@example(envelope([(0, 0), (1, 11), (1, 10), (101, 10)], 20), [1.0])  # ends at a jump
def test_impulse_and_loss_over_a_step_are_those_of_many_small_ones(curve: Envelope, rates: list[float]):
    """On any path: up and down, through several points of the curve at once, through none, through no force.

    What is lost is the work less what the spring holds more. The small steps book a little more themselves where a
    dashpot holds the force at the curve and this falls: they count it with the spring. The rate stays the same for two
    steps; what a dashpot does where it changes at once is not compared.
    """
    followed, small = Alone(curve, follows=True), Alone(curve)
    scale = 1e3 + np.max(curve.force)  # a jump counts for as much within one of the small steps
    steepest = np.max(np.abs(curve.slope[np.isfinite(curve.slope)]))
    u = 0.0
    for rate in rates:
        for n in range(2):
            to, before = u + rate * H, followed.force
            room = (5.0 * scale + steepest * abs(rate) * H) / N  # what one of the small steps may miss
            lost, held = followed.lost, spring_of(small, curve, u)
            force = followed.to(to, rate, H)
            forces = [small.force, *(small.to(u + (to - u) * k / N, rate, H / N) for k in range(1, N + 1))]
            assert force == pytest.approx(forces[-1], abs=room)
            if n or not curve.damping:
                impulse = 0.5 * (before + force) + followed.of(ELEMENT.LATE) / H
                assert impulse == pytest.approx(np.trapezoid(forces) / N, abs=room)
                work = np.trapezoid(forces) / N * (to - u)
                loss = work - (spring_of(small, curve, to) - held)
                assert followed.lost - lost == pytest.approx(loss, abs=room * abs(to - u) + 1e-6)
            u = to


@settings(max_examples=60)
@given(envelopes(), st.lists(st.floats(-0.02, 0.06), min_size=1, max_size=8))
def test_lost_and_stored_are_the_area_below_its_force(curve: Envelope, ways: list[float]):
    """The impulse over the way, in steps as long as the whole curve, is the energy that is lost or in the spring."""
    alone, u, work = Alone(replace(curve, damping=0.0), follows=True), 0.0, 0.0
    for way in ways:
        before = alone.force
        alone.to(u + way, way / H, H)
        work += (0.5 * (before + alone.force) + alone.of(ELEMENT.LATE) / H) * way
        u += way
    assert alone.lost + alone.stored == pytest.approx(work, rel=1e-4, abs=1e-3)


def test_a_draw_gear_that_has_broken_gives_no_impulse_any_more():
    """Breaks if what was late in the step in which it broke were given again in every step that follows."""
    spec = KINDS_OF_DEVICE["tube"] | {
        "pull": {"stiffness_kN_per_mm": 50, "slack_mm": 5, "breaking_force_kN": 600},
    }
    (sides,) = built(d=spec).values()
    (pull,) = (element for element in meet(sides, coupled=True) if element.sign < 0.0)
    alone = Alone(pull, follows=True)
    for extension in (0.0, 0.004, 0.06, 0.07):
        alone.to(-extension, -5.0, H)
    assert alone.of(ELEMENT.BROKEN)
    assert alone.of(ELEMENT.LATE) == 0.0


@pytest.mark.parametrize("damping", [0.0, 30.0])
def test_a_mass_in_a_curve_that_jumps_stops_where_the_formula_says(damping: float):
    """Errors fall with the square of the step, with a dashpot too; euler's hang on where in a step the force jumps."""
    exact = stopped(CLIMBED, 40.0, 2.0) if damping == 0.0 else stroke_in_jumps(EVENTS, 0.002, damping)
    ours, theirs = (
        np.array([abs(stroke_in_jumps(integrator, step, damping) - exact) for step in JUMPING_STEPS_MS])
        for integrator in (EVENTS, "euler")
    )
    assert (ours <= 0.005 * np.square(JUMPING_STEPS_MS)).all()
    assert (theirs > 50 * ours).all()


def test_the_wall_takes_the_momentum_that_the_mass_loses():
    """With what was late: the impulse that the law has counted, beside the speeds."""
    case = chain([40e3], [envelope(JUMPING, 800)], [2.0], step=0.5e-3, steps_per_record=1, time_limit=0.2)
    ride = Ride(replace(case, integrator=EVENTS))
    for _ in range(400):
        ride.go(case.step)
        momentum = 40e3 * (ride.tally.speed[0] - 2.0)
        assert ride.tally.impulse == pytest.approx(momentum, abs=1e-9 * 80e3)
    assert momentum < -80e3, "it comes back"


def one_kind(seed: int) -> Scenario:
    """A random train without rail friction, all of whose devices are alike: no two different ones in series."""
    values = random_collision(seed, 6).values()
    for train in values["trains"].values():
        train["front"] = "d0"
        for car in train["vehicles"]:
            car["coupler"] = "d0"
    values["collision"]["rail_friction"] = 0.0
    values["simulation"] |= {"step_ms": 0.2, "record_every_ms": 1.0, "time_limit_s": 0.5}
    return Scenario.from_values(values)


@pytest.mark.parametrize("seed", few([11, 6, 9, 5, 0, 1, 2, 3, 4, 7, 8, 10], 1))
def test_random_trains_keep_momentum_and_energy_and_come_near_scipy(seed: int):
    """Beside euler at the same step of 0.2 ms; where bolts shear off, many times nearer."""
    scenario = one_kind(seed)
    apart = {}
    for integrator in ("euler", EVENTS):
        result = run(scenario.with_values({"simulation.integrator": integrator}))
        theirs = strokes(result, solve(scenario.values(), result.tally.time))
        apart[integrator] = np.abs(theirs - result.tally.stroke_max).max() / theirs.max()
    mass, tally = result.chain.mass, result.tally
    kept = (mass * (tally.speed - result.chain.speed)).sum() / (mass * np.abs(result.chain.speed)).sum()
    assert abs(kept) < 1e-9
    assert abs(summarise(result).balance.energy_error) < 1e-3
    assert apart[EVENTS] <= 1.1 * apart["euler"] + 1.5e-6
    if seed in (5, 6, 11):
        assert apart[EVENTS] < 0.2 * apart["euler"]


@pytest.mark.parametrize("other", few([None, "damped", "tube", "oil"], 1))
@pytest.mark.parametrize("name", KINDS_OF_DEVICE)
def test_just_below_the_largest_step_no_energy_is_made(name: str, other: str | None):
    """Breaks if the step that euler may take is too large for forces at the rate at the end of a step."""
    if other != name:
        found, _ = ridden(name, other, 0.99, EVENTS)
        assert found.balance.kinetic_end_kJ <= found.balance.kinetic_start_kJ * (1 + 1e-9)


@pytest.mark.thorough
def test_what_kinds_gain_and_what_they_do_not():
    """40 t at 3 m/s and 0.5 ms: crush, with a rate too, has the strokes of a fine step; what the oil holds does not."""
    apart = {}
    for name in ("sheared", "rated", "at_speeds", "oil", "preloaded", "gas", "quick_gas"):
        fine, ours, theirs = (into_wall(name, *how) for how in ((2.5e-6, EVENTS), (5e-4, EVENTS), (5e-4, "euler")))
        apart[name] = [abs(ours - fine), abs(theirs - fine)]
    for name in ("sheared", "rated", "at_speeds"):
        assert apart[name][0] < 0.003
        assert apart[name][1] > 0.05
    for name in ("oil", "preloaded", "gas", "quick_gas"):
        assert max(apart[name]) < 0.1


def into_wall(name: str, step: float, integrator: str) -> float:
    """Largest stroke of a device against a wall [mm]."""
    _, case = ridden(name, None, 0.5)
    ((_, found),) = run_chains([(0, replace(case, step=step, integrator=integrator, time_limit=0.5))])
    return found.interfaces[0].stroke_mm


def test_b_type_at_five_times_the_default_step():
    """Strokes within 0.01 mm of the limit, where euler is off by up to 1.2 mm; peaks are another matter, see below."""
    fine = collided("b_type", "euler", 0.0025)
    for step in (0.1, 0.25, 0.5):
        found = collided("b_type", EVENTS, step)
        assert _strokes(found) == pytest.approx(_strokes(fine), abs=0.012)
        assert found.TS_mm == pytest.approx(fine.TS_mm, rel=2e-6)
        assert found.TAMA_g == pytest.approx(fine.TAMA_g, rel=2e-6)
        assert abs(found.balance.energy_error) < 1e-6
    assert np.abs(np.subtract(_strokes(collided("b_type", "euler", 0.25)), _strokes(fine))).max() > 1.0


def collided(name: str, integrator: str, step_ms: float) -> Summary:
    """A shipped scenario at a step."""
    changes = {"simulation.integrator": integrator, "simulation.step_ms": step_ms}
    ((_, found),) = run_chains([(0, line_up(load(name, changes)))])
    return found


def _strokes(summary: Summary) -> list[float]:
    return [interface.stroke_mm for interface in summary.interfaces]


def test_a_vertical_plane_refuses_it():
    with pytest.raises(InputError, match="follows devices along the track only: state euler, or plane: line"):
        load("b_type_vertical", {"simulation.integrator": EVENTS})


def test_halving_the_step_settles_at_once():
    found = converge("b_type_wall", ["TS_mm", "stroke_*"], changes=LONG)
    assert found.settled
    assert found.step_ms == pytest.approx([0.5, 0.25, 0.125, 0.0625])
    assert max(found.stroke_changes_mm) < 0.002
    assert max(one.error for one in found.estimates.values()) < 2e-5


LONG = {"simulation.integrator": EVENTS, "simulation.step_ms": 0.5}


def test_a_run_says_how_it_was_made(tmp_path):
    words = ["run", "b_type_wall", "--set", "simulation.integrator=events", "--set", "simulation.step_ms=0.5"]
    said = CliRunner().invoke(main, [*words, "--out", str(tmp_path), "--report", "--figures", "none"])
    assert said.exit_code == 0
    assert "step (events), against the largest stable one" in said.output
    assert "0.5 ms (events), recorded every 1 ms" in (tmp_path / "report.html").read_text("utf-8")
    checked = CliRunner().invoke(main, ["check", *words[1:]])
    assert "Step 0.5 ms (events), stable up to 0.603 ms" in checked.output


PHYSICS = Path(__file__).parents[1] / "docs" / "physics.md"


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["b_type", "b_type_wall", "en15227_c1", "wagon_80t"])
def test_the_errors_that_the_documentation_has(name: str):
    """Deviations from a step of 0.0025 ms, as in its table: in %, %, mm, %; to half of their last digit and 5 %."""
    lines = [line for line in PHYSICS.read_text("utf-8").splitlines() if line.startswith(f"| `{name}` |")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")][1:] for line in lines]
    assert len(rows) == 6
    fine = collided(name, EVENTS, 0.0025)
    for integrator, step, *said in rows:
        found = collided(name, integrator, float(step.removesuffix(" ms")))
        peaks = [
            abs(a.peak_device_acceleration_g / b.peak_device_acceleration_g - 1)
            for a, b in zip(found.vehicles, fine.vehicles, strict=True)
        ]
        apart = [
            100 * (found.TS_mm / fine.TS_mm - 1),
            100 * (found.TAMA_g / fine.TAMA_g - 1),
            np.abs(np.subtract(_strokes(found), _strokes(fine))).max(),
            100 * max(peaks),
        ]
        for number, text in zip(apart, said, strict=True):
            digits = len(text.split(".")[1].split()[0])
            assert float(text.split()[0]) == pytest.approx(number, abs=0.51 * 10**-digits, rel=0.05)
