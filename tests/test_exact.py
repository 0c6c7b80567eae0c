"""Collisions whose outcome is known without this program: the cases that users run too, and a few for tests alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import Alone, joined

from trainmj.collision.chain import Element
from trainmj.collision.envelope import Array
from trainmj.collision.fields import ELEMENT
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.scenario import load
from trainmj.verification import bodies, oracles, plane, published
from trainmj.verification.suite import GROUPS, Case
from trainmj.verification.systems import chain, envelope, follow, shipped

# the paper has tests of its own, as have random trains, bodies and the vertical plane
ELSEWHERE = (published.paper, oracles.random_by_scipy, oracles.every_kind_by_scipy, oracles.bodies_by_scipy)
ELSEWHERE += bodies.CASES + plane.CASES
# seconds each; others of the same kind are quicker
THOROUGH = {
    "standard_by_scipy",
    "three_masses_by_scipy",
    "order_by_kind",
    "order_of_convergence",
    "Brake that rises",
    "Brake after a delay, downhill",
    "Draw gear",
    "Draw gear that breaks",
    "Gas buffer, no orifice",
    "Hysteresis, from zero force",
    "Rate factor, C 20 m/s, P 1",
    "Hydraulic buffer, constant orifice",
    "Hydraulic buffer, preload",
    "Standing wagon on 5 per mille",
}
CASES = [
    pytest.param(c, id=c.__name__, marks=[pytest.mark.thorough] * (c.__name__ in THOROUGH))
    for group in GROUPS
    for c in group.cases
    if c not in ELSEWHERE
]


assert {case.id for case in CASES} >= THOROUGH


@pytest.mark.parametrize("case", CASES)
def test_known_outcome(case: Case):
    checks = list(case())
    assert checks
    assert [c for c in checks if not c.passed] == []


@pytest.mark.thorough
def test_random_trains_by_scipy(random_trains):
    """Strokes within 0.1 % of the largest, energy balance within 1e-3; ``--random-trains 50`` takes 50 seeds."""
    checks = list(oracles.random_by_scipy(range(random_trains), most=40 if random_trains > 10 else 6))
    assert [c for c in checks if not c.passed] == []


@pytest.fixture(scope="module")
def every_step() -> Result:
    """The standard collision with every step on record."""
    return run(load("b_type", {"simulation.record_every_ms": 0.1}))


def dissipated(element: Element, stroke: Array, rate: Array) -> tuple[float, float]:
    """What a crush element loses along a history, counted from its law, and what is left in its spring [J].

    The work that the tally counts closes the balance of the integrator by construction (summation by parts), whatever
    the step; this account does not know the equations of motion.
    """
    alone, stiffness = Alone(element), element.laws[0].parameters[0]
    plastic, before, lost = 0.0, 0.0, 0.0
    for n, u in enumerate(stroke):
        alone.to(float(u), float(rate[n]))
        moved = alone.of(ELEMENT.STATE_0)
        if moved > plastic:
            lost += alone.force * (moved - plastic)
        elif alone.force > 0.0 and n:
            lost += (alone.force - stiffness * (alone.stroke - plastic)) * (alone.stroke - before)
        plastic, before = moved, alone.stroke
    return lost / element.share, 0.5 * stiffness * max(0.0, alone.stroke - plastic) ** 2 / element.share


def test_energy_balance_of_the_standard_case_by_an_account_of_its_own(every_step):
    """<= 1e-3 of the initial kinetic energy at the default step: speeds against what devices and rails lose."""
    chain_, r = every_step.chain, every_step
    kinetic = 0.5 * (chain_.mass * r.velocity**2).sum(axis=1)
    losses = [dissipated(i.elements[0], r.stroke[:, k], r.stroke_rate[:, k]) for k, i in enumerate(chain_.interfaces)]
    devices = sum(a + b for a, b in losses)
    rails = float((chain_.friction * np.trapezoid(np.abs(r.velocity), r.time, axis=0)).sum())
    error = (kinetic[0] - kinetic[-1] - devices - rails) / kinetic[0]
    assert abs(error) <= 1e-3
    each = np.array([a for a, _ in losses]) / 1e3
    assert each == pytest.approx(r.energy[-1] / 1e3, rel=2e-3, abs=0.05), "interface by interface, in kJ"


def test_absorbed_energy_is_the_area_under_the_curve():
    """Without dashpots: loading along the curve, less what the spring gives back."""
    case = shipped("en15227_c1", {"collision.speed_km_h": 20})
    result = run(load("en15227_c1", {"collision.speed_km_h": 20}))
    for k, interface in enumerate(case.interfaces):
        (element,) = interface.elements
        path, top = element.laws[0].loading.climbing, element.share * float(result.tally.stroke_max[k])
        area = (path.energy(top) - 0.5 * path.force_at(top) ** 2 / path.stiffness) / element.share
        assert result.energy[-1, k] == pytest.approx(area, rel=2e-3, abs=50.0), interface.name


def test_a_pair_in_series_is_two_devices_with_a_light_body_between():
    """What two devices in series claim, simulated: the same force and strokes when a plate of 100 kg parts the two."""
    e = envelope([(0, 0), (50, 600), (200, 900), (600, 900)], 40)
    other = envelope([(0, 0), (30, 700), (300, 800), (900, 1200)], 70)
    parted = follow(chain([33e3, 100.0, 33e3], [e, other], [4.0, 2.0, 0.0], step=1e-6, time_limit=0.15))
    pair = replace(chain([33e3, 33e3], [e], [4.0, 0.0], step=1e-6, time_limit=0.15), interfaces=(joined(e, other),))
    together = follow(pair)
    assert float(parted.stroke_max.sum()) == pytest.approx(float(together.stroke_max[0]), rel=0.01)
    assert parted.stroke_max == pytest.approx(together.element_stroke_max[1:], rel=0.03)
    assert parted.force_max.max() == pytest.approx(together.force_max[0], rel=0.05)
