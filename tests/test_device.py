"""Crush curves and the law that follows them, as plain Python."""

from __future__ import annotations

import numpy as np
import pytest
from builders import Alone, envelope
from hypothesis import given, settings
from hypothesis import strategies as st

from trainmj.collision.device import Stage
from trainmj.collision.envelope import Envelope
from trainmj.collision.fields import ELEMENT
from trainmj.errors import InputError

SPRING = envelope([(0, 0), (10, 1000), (500, 1000)], 100)  # 1000 kN plateau from 10 mm, unloads along 100 kN/mm
DAMPED = envelope([(0, 0), (10, 1000), (500, 1000)], 200, 50)
STEPPED = envelope([(0, 0), (100, 500), (100, 800), (200, 800), (200.5, 0), (250, 0), (250.5, 1200), (900, 1200)], 300)


def replay(e: Envelope, strokes_mm: list[float], rate: float = 0.0) -> list[tuple[float, float]]:
    """Forces [kN] and plastic strokes [mm] along a history."""
    pressed = Alone(e)
    return [(pressed.to(u * 1e-3, rate) / 1e3, pressed.of(ELEMENT.STATE_0) * 1e3) for u in strokes_mm]


def test_first_loading_follows_the_envelope_and_a_plateau_holds():
    assert replay(SPRING, [2, 5, 10, 50, 300, 700]) == [
        (pytest.approx(200), pytest.approx(0, abs=1e-12)),
        (pytest.approx(500), pytest.approx(0, abs=1e-12)),
        (pytest.approx(1000), pytest.approx(0, abs=1e-12)),
        (pytest.approx(1000), pytest.approx(40)),
        (pytest.approx(1000), pytest.approx(290)),
        (pytest.approx(1000), pytest.approx(690)),  # past its last point an envelope holds its force
    ]


def test_unloading_and_reloading_follow_the_stiffness_back_to_the_envelope():
    forces = [f for f, _ in replay(SPRING, [60, 56, 51, 53, 60, 61])]
    assert forces == pytest.approx([1000, 600, 100, 300, 1000, 1000])


def test_unloading_keeps_the_plastic_stroke():
    states = [p for _, p in replay(SPRING, [60, 56, 51, 40, 53])]
    assert states == pytest.approx([50] * 5), "only crushing may move the plastic state"


def test_devices_never_pull():
    assert [f for f, _ in replay(SPRING, [60, 49, 0, -20])] == pytest.approx([1000, 0, 0, 0])
    loading = replay(DAMPED, [60, 56], rate=-10.0)
    assert loading[-1][0] == 0.0, "a fast rebound lets the dashpot cancel the force, but never pull"


def test_dashpot_acts_on_the_elastic_branch_only():
    pressed = Alone(DAMPED)
    assert pressed.to(0.060, 1.0) == pytest.approx(1e6), "crushing is independent of rate"
    at_rest = pressed.to(0.057)
    assert pressed.to(0.057, 1.0) - at_rest == pytest.approx(50e3 * 1.0)
    assert pressed.to(0.057, -2.0) - at_rest == pytest.approx(-50e3 * 2.0)
    assert pressed.to(0.050, 9.0) == 0.0, "without elastic force there is no dashpot force"


STEEP = envelope([(0, 0), (10, 100), (10.1, 1000), (500, 1000)], 200, 50)  # rises at 9000 kN/mm, unloads at 200


def test_first_loading_never_passes_the_envelope_however_fast():
    """A rise steeper than the stiffness is climbed on the elastic branch, where the dashpot acts."""
    forces = [f for f, _ in replay(STEEP, [10, 10.5, 11, 14, 14.4, 14.5, 15], rate=5.0)]
    assert max(forces) == 1000, "the dashpot carries a device past its crush force at the end of a climb"
    assert forces[1:3] == pytest.approx([100 + 100 + 250, 100 + 200 + 250]), "below the envelope it acts"


def test_a_fast_reload_does_not_pass_the_envelope_either():
    forces = [f for f, _ in replay(DAMPED, [60, 58, 59.9], rate=5.0)]
    assert forces == pytest.approx([1000, 850, 1000]), "the dashpot acts below the crush force and ends there"


def test_a_jump_counts_with_the_force_behind_it():
    assert STEPPED.force_at(0.0999999) == pytest.approx(500e3, rel=1e-5)
    assert STEPPED.force_at(0.1) == 800e3
    assert STEPPED.force_at(0.15) == 800e3


def test_shear_off_and_empty_stroke_carry_nothing_and_do_not_recover():
    forces = [f for f, _ in replay(STEPPED, [150, 199.9, 225, 199.9, 225, 300])]
    assert forces == pytest.approx([800, 800, 0, 0, 0, 1200]), "a device that has sheared off stays so"


def test_envelope_that_rises_faster_than_the_stiffness_is_climbed_along_it():
    soft = envelope([(0, 0), (1, 1000), (500, 1000)], 10)
    assert [f for f, _ in replay(soft, [1, 50, 100, 101])] == pytest.approx([10, 500, 1000, 1000])


def test_energy_of_first_loading():
    assert SPRING.energy(0.010) == pytest.approx(5000.0)
    assert SPRING.energy(0.110) == pytest.approx(5000.0 + 100e3)
    assert SPRING.energy(0.600) == pytest.approx(5000.0 + 590e3), "past the last point the force holds"
    assert STEPPED.energy(0.100) == pytest.approx(25e3), "at a jump the force before it counts"
    assert STEPPED.energy(0.200) == pytest.approx(25e3 + 80e3)
    assert STEPPED.energy(0.0) == 0.0


@settings(max_examples=50, deadline=None)
@given(st.floats(0.0, 0.95))
def test_energy_is_the_integral_of_the_force(stroke: float):
    u = np.unique(np.concatenate([np.linspace(0.0, stroke, 2_001), STEPPED.stroke[STEPPED.stroke <= stroke]]))
    middle = (u[1:] + u[:-1]) / 2
    total = float(np.sum([STEPPED.force_at(x) for x in middle] * np.diff(u)))
    assert STEPPED.energy(stroke) == pytest.approx(total, rel=1e-9, abs=1e-6)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-20.0, 400.0), min_size=1, max_size=60), st.floats(0, 20))
def test_quasi_static_work_is_never_negative_on_a_closed_history(strokes: list[float], stiffness_more: float):
    """A device that gave back more than it took would make energy out of nothing."""
    e = envelope([(0, 0), (50, 800), (60, 300), (61, 0), (120, 0), (121, 1250), (1500, 1250)], 60 + stiffness_more)
    fine = np.concatenate([np.linspace(a, b, 400) for a, b in zip([0.0, *strokes], [*strokes, 0.0], strict=True)])
    force = np.array(replay(e, list(fine)))[:, 0]
    work = float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(fine)))
    assert work >= -1e-3 * max(1.0, float(np.sum(np.abs((force[1:] + force[:-1]) / 2 * np.diff(fine)))))


POINTS = "an envelope needs two or more points, as many strokes as forces"
FINITE = "an envelope must be finite at every point"
FORWARD = "the strokes of an envelope must start at 0 and never go back"
PUSH_ONLY = "the forces of an envelope must not be negative: devices push only"
CONSTANTS = "an envelope needs a stiffness > 0 and a damping >= 0"


@pytest.mark.parametrize(
    ("stroke", "force", "stiffness", "damping", "said"),
    [
        ([0.0, 1.0], [0.0], 1.0, 0.0, POINTS),
        ([0.0], [0.0], 1.0, 0.0, POINTS),
        ([[0.0, 1.0]] * 2, [[0.0, 1.0]] * 2, 1.0, 0.0, POINTS),
        ([0.0, 0.2, 0.1], [0.0, 1.0, 1.0], 1.0, 0.0, FORWARD),
        ([0.1, 0.2], [0.0, 1.0], 1.0, 0.0, FORWARD),
        ([0.0, 0.2], [0.0, -1.0], 1.0, 0.0, PUSH_ONLY),
        ([0.0, np.nan], [0.0, 1.0], 1.0, 0.0, FINITE),
        ([0.0, 0.2], [0.0, np.inf], 1.0, 0.0, FINITE),
        ([0.0, 0.2], [0.0, 1.0], 0.0, 0.0, CONSTANTS),
        ([0.0, 0.2], [0.0, 1.0], np.inf, 0.0, CONSTANTS),
        ([0.0, 0.2], [0.0, 1.0], np.nan, 0.0, CONSTANTS),
        ([0.0, 0.2], [0.0, 1.0], 1.0, -1.0, CONSTANTS),
        ([0.0, 0.2], [0.0, 1.0], 1.0, np.inf, CONSTANTS),
    ],
)
def test_an_impossible_envelope_is_refused(stroke, force, stiffness, damping, said):
    with pytest.raises(InputError) as refused:
        Envelope(np.array(stroke), np.array(force), stiffness, damping)
    assert str(refused.value) == said


def test_slopes_are_those_behind_each_point():
    """0 across a jump and behind the last point, where the force holds."""
    e = Envelope(np.array([0.0, 2.0, 2.0, 4.0]), np.array([1.0, 5.0, 6.0, 0.0]), 0.5)
    assert e.slope.tolist() == [2.0, 0.0, -3.0, 0.0]
    assert e.damping == 0.0
    assert e.force_at(-1.0) == -1.0, "in front of the first point the curve goes on as it begins"
    assert " slope" not in repr(e), "what follows from the rest is not shown"


def test_the_law_where_its_branches_meet():
    """Exactly at F_el = 0 there is no dashpot force, exactly at F_el = F_env there is no dashpot relief."""
    e = Envelope(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0, 2.0]), 4.0, 3.0)
    for stroke, rate, force in ((1.0, 9.0, 0.0), (1.5, -9.0, 2.0)):
        pressed = Alone(e)
        assert pressed.to(1.5) == 2.0
        assert (pressed.to(stroke, rate), pressed.of(ELEMENT.STATE_0)) == (force, 1.0)
    soft = Alone(Envelope(np.array([0.0, 1.0]), np.array([0.0, 2.0]), 0.5))
    assert (soft.to(0.5), soft.of(ELEMENT.STATE_0)) == (0.25, 0.0), "a force below 1 N is a force"


def test_stage_counts_its_own_stroke_only():
    stage = Stage("anti_climber", 0.375, np.inf, 0.265)
    assert [stage.stroke(u) for u in (0.1, 0.375, 0.6)] == pytest.approx([0, 0, 0.225])
    assert Stage("coupler", 0.0, 0.353).stroke(0.5) == 0.353, "a stage that is used up grows no further"


def test_a_curve_that_rises_faster_than_its_stiffness_is_climbed_along_it():
    """The path of first loading is the one that the law takes."""
    e = envelope([(0, 100), (20, 2000), (100, 2000), (100, 2400), (150, 100), (160, 900), (400, 900)], 50)
    path = e.climbing
    pressed = Alone(e)
    for stroke in np.linspace(0, 0.5, 5001)[1:].tolist():
        assert path.force_at(stroke) == pytest.approx(pressed.to(stroke), abs=6e3), "a step climbs by 5 kN"
    flat = envelope([(0, 0), (10, 400), (300, 500)], 50)
    assert flat.climbing is flat
