"""The readable form of the device law, and two devices in series."""

from __future__ import annotations

import numpy as np
import pytest
from builders import device, envelope, joined
from hypothesis import given, settings
from hypothesis import strategies as st

from trainmj.collision.device import Envelope, Stage, in_series
from trainmj.errors import InputError

SPRING = envelope([(0, 0), (10, 1000), (500, 1000)], 100)  # 1000 kN plateau from 10 mm, unloads along 100 kN/mm
DAMPED = envelope([(0, 0), (10, 1000), (500, 1000)], 200, 50)
STEPPED = envelope([(0, 0), (100, 500), (100, 800), (200, 800), (200.5, 0), (250, 0), (250.5, 1200), (900, 1200)], 300)


def replay(e: Envelope, strokes_mm: list[float], rate: float = 0.0) -> list[tuple[float, float]]:
    """Forces [kN] and plastic strokes [mm] along a history."""
    plastic, out = 0.0, []
    for u in strokes_mm:
        force, plastic = e.respond(u * 1e-3, rate, plastic)
        out.append((force / 1e3, plastic * 1e3))
    return out


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
    _, plastic = DAMPED.respond(0.060, 1.0, 0.0)
    assert DAMPED.respond(0.060, 1.0, 0.0)[0] == pytest.approx(1e6), "crushing is independent of rate"
    at_rest = DAMPED.respond(0.057, 0.0, plastic)[0]
    assert DAMPED.respond(0.057, 1.0, plastic)[0] - at_rest == pytest.approx(50e3 * 1.0)
    assert DAMPED.respond(0.057, -2.0, plastic)[0] - at_rest == pytest.approx(-50e3 * 2.0)
    assert DAMPED.respond(0.050, 9.0, plastic)[0] == 0.0, "without elastic force there is no dashpot force"


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


@settings(max_examples=100, deadline=None)
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
    assert "slope" not in repr(e), "what follows from the rest is not shown"


def test_the_law_where_its_branches_meet():
    """Exactly at F_el = 0 there is no dashpot force, exactly at F_el = F_env there is no dashpot relief."""
    e = Envelope(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0, 2.0]), 4.0, 3.0)
    assert e.respond(1.0, 9.0, 1.0) == (0.0, 1.0)
    assert e.respond(1.5, -9.0, 1.0) == (2.0, 1.0)
    soft = Envelope(np.array([0.0, 1.0]), np.array([0.0, 2.0]), 0.5)
    assert soft.respond(0.5, 0.0, 0.0) == (0.25, 0.0), "a force below 1 N is a force"


def test_stage_counts_its_own_stroke_only():
    stage = Stage("anti_climber", 0.375, np.inf, 0.265)
    assert [stage.stroke(u) for u in (0.1, 0.375, 0.6)] == pytest.approx([0, 0, 0.225])
    assert Stage("coupler", 0.0, 0.353).stroke(0.5) == 0.353, "a stage that is used up grows no further"


# two devices in series

curves = st.lists(st.tuples(st.floats(1.0, 200.0), st.floats(1.0, 500.0)), min_size=2, max_size=6)


def rising(steps: list[tuple[float, float]], stiffness: float = 2000.0) -> Envelope:
    """A curve that rises at every point, so that each force belongs to one stroke."""
    return envelope([(0.0, 0.0), *np.cumsum(np.array(steps), axis=0)], stiffness)


def test_equal_devices_in_series_give_the_force_of_one_at_twice_the_stroke():
    e = envelope([(0, 0), (73, 800), (353, 1000), (353.3, 0), (375, 0), (375.2, 1250), (900, 1250)], 350, 11)
    pair, (left, _) = in_series(device(e), device(e))
    assert np.array_equal(pair.stroke, 2 * e.stroke)
    assert np.array_equal(pair.force, e.force)
    assert (pair.stiffness, pair.damping) == (e.stiffness / 2, e.damping / 2)
    assert np.array_equal(left, e.stroke), "either side takes half of the stroke"


@settings(max_examples=100, deadline=None)
@given(curves, curves)
def test_different_devices_in_series_share_the_force_and_add_strokes_and_energies(a, b):
    first, second = rising(a), rising(b, 500.0)
    pair, (left, right) = in_series(device(first), device(second))
    carried = pair.stroke <= pair.stroke[-1]
    assert pair.force[-1] == pytest.approx(min(first.force[-1], second.force[-1]))
    for u, f, x, y in zip(pair.stroke[carried], pair.force, left, right, strict=True):
        assert first.force_at(x) == pytest.approx(f, rel=1e-9, abs=1e-3), "the left device must carry the pair's force"
        assert second.force_at(y) == pytest.approx(f, rel=1e-9, abs=1e-3), "so must the right one"
        total = first.energy(x) + second.energy(y)
        assert pair.energy(u) == pytest.approx(total, rel=1e-9, abs=1e-3), "no energy is lost between the two"
    assert 1 / pair.stiffness == pytest.approx(1 / first.stiffness + 1 / second.stiffness)


@settings(max_examples=50, deadline=None)
@given(curves, curves)
def test_series_does_not_depend_on_which_device_is_named_first(a, b):
    first, second = device(rising(a)), device(rising(b, 500.0))
    one, (left, _) = in_series(first, second)
    other, (right, _) = in_series(second, first)
    assert np.array_equal(one.stroke, other.stroke)
    assert np.array_equal(one.force, other.force)
    assert left + right == pytest.approx(one.stroke, abs=1e-12)


def test_stiffnesses_and_dashpots_in_series_combine_as_reciprocals():
    curve = [(0, 0), (10, 500), (100, 500)]
    pair, _ = in_series(device(envelope(curve, 100, 12)), device(envelope(curve, 300, 36)))
    assert (pair.stiffness, pair.damping) == (pytest.approx(75e6), pytest.approx(9e3))
    rigid, _ = in_series(device(envelope(curve, 100, 12)), device(envelope(curve, 300, 0)))
    assert rigid.damping == 0.0, "the reciprocal of no dashpot is infinite"


def test_the_weaker_plateau_crushes_first():
    weak, strong = (
        envelope([(0, 0), (10, 500), (300, 500), (301, 900), (400, 900)], 1000),
        envelope([(0, 0), (10, 700), (100, 700)], 1000),
    )
    pair, (left, _) = in_series(device(weak), device(strong))
    strong_at_500 = 10 * 500 / 700 * 1e-3
    assert np.interp(0.300 + strong_at_500, pair.stroke, left) == pytest.approx(0.300)
    assert pair.force_at(0.2) == 500e3
    assert pair.force_at(0.35) == 700e3
    assert pair.energy(0.310) == pytest.approx(weak.energy(0.3004) + strong.energy(0.0096), rel=1e-2)


def test_equal_plateaus_of_different_curves_crush_one_after_the_other():
    first = envelope([(0, 0), (10, 500), (100, 500), (110, 900)], 1000)
    second = envelope([(0, 0), (20, 500), (60, 500), (90, 800)], 500)
    pair, (left, _) = in_series(device(first), device(second))
    assert (pair.stroke * 1e3).tolist() == pytest.approx([0, 30, 120, 160, 160 + 7.5 + 30])
    assert (left * 1e3).tolist() == pytest.approx([0, 10, 100, 100, 107.5])
    assert (pair.force / 1e3).tolist() == pytest.approx([0, 500, 500, 500, 800])


def test_a_curve_that_rises_faster_than_its_stiffness_is_climbed_along_it():
    """Alone and in series alike: the path of first loading is the one that the law takes."""
    e = envelope([(0, 100), (20, 2000), (100, 2000), (100, 2400), (150, 100), (160, 900), (400, 900)], 50)
    path = e.climbing
    plastic = 0.0
    for stroke in np.linspace(0, 0.5, 5001)[1:]:
        force, plastic = e.respond(float(stroke), 0.0, plastic)
        assert path.force_at(float(stroke)) == pytest.approx(force, abs=6e3), "a step climbs by 5 kN"
    flat = envelope([(0, 0), (10, 400), (300, 500)], 50)
    assert flat.climbing.is_like(flat)


def test_in_series_a_steep_curve_gives_way_along_its_stiffness():
    """5 kN/mm to 2000 kN in series with a spring of 5 kN/mm, whose own curve is out of reach: each takes half."""
    hard = device(envelope([(0, 0), (400, 2000)], 1000))
    soft = device(envelope([(0, 0), (20, 2000), (400, 2000)], 5))
    for pair in ((hard, soft), (soft, hard)):
        law, (first, _) = in_series(*pair)
        assert law.force_at(0.32) == pytest.approx(800e3)
        assert np.interp(0.32, law.stroke, first) == pytest.approx(0.16)


def test_both_devices_carry_the_force_of_the_pair():
    """On curves that never fall, each stands on its own path of first loading at every point of the common one."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        pair = []
        for _ in range(2):
            n = int(rng.integers(2, 6))
            strokes, forces = np.append(0, np.cumsum(rng.uniform(2, 200, n))), np.cumsum(rng.uniform(0, 500, n + 1))
            pair.append(device(envelope(list(zip(strokes, forces, strict=True)), 10 ** rng.uniform(0, 3))))
        law, (first, _) = in_series(*pair)
        for each, stroke in zip(pair, (first, law.stroke - first), strict=True):
            own = [each.envelope.climbing.force_at(float(u)) for u in stroke]
            assert own == pytest.approx(law.force, rel=1e-6, abs=1.0)


def test_only_curves_that_are_alike_in_all_are_halves_of_one():
    """A pair that differs in its stiffness alone is split where the stiffness says, and so in any other constant."""
    curve = [(0, 0), (10, 500), (20, 100), (30, 900)]
    for other in (envelope(curve, 100, 3), envelope(curve, 200, 2), envelope([*curve[:3], (30, 901)], 200, 3)):
        pair, (left, _) = in_series(device(envelope(curve, 200, 3)), device(other))
        assert len(left) > len(curve), "at the drop one side unloads while the other one goes on"
        assert pair.stiffness == pytest.approx(1 / (1 / 200e6 + 1 / other.stiffness))


def test_train_head_against_wagon_buffers():
    """The case of scenarios/wagon_80t.yaml: buffers at first, then the head's plateau of 1100 kN to its end."""
    head = envelope([(0, 0), (87, 600), (587, 600), (592, 1100), (3587, 1100)], 100)
    buffers = envelope([(0, 0), (105, 1180), (110, 3000), (200, 3000)], 400)
    pair, (left, _) = in_series(device(head), device(buffers))
    buffers_at = {f: 105 * f / 1180 * 1e-3 for f in (600, 1100)}
    assert np.interp(0.587 + buffers_at[600], pair.stroke, left) == pytest.approx(0.587)
    assert pair.stroke[-1] == pytest.approx(3.587 + buffers_at[1100])
    assert pair.force[-1] == 1100e3
    total = head.energy(3.587) + buffers.energy(buffers_at[1100])
    assert pair.energy(pair.stroke[-1]) == pytest.approx(total, rel=1e-9)


def test_while_one_device_shears_off_the_other_unloads_along_its_stiffness():
    shearing = envelope([(0, 0), (50, 1000), (60, 0), (100, 0), (101, 1500), (500, 1500)], 2000)
    other = envelope([(0, 0), (40, 1200), (400, 1200)], 500)
    pair, (left, right) = in_series(device(shearing), device(other))
    at_peak = 40 * 1000 / 1200 * 1e-3
    k = int(np.flatnonzero(np.isclose(left, 0.060))[0])
    assert pair.force[k] == 0.0, "the sheared device carries nothing, so neither does the pair"
    assert right[k] == pytest.approx(at_peak - 1000e3 / other.stiffness), "the other gives back its elastic stroke only"
    again = int(np.flatnonzero(left > 0.1005)[0])
    assert right[again] == pytest.approx(at_peak, abs=1e-4), "and takes it again before it crushes on"


def test_path_of_a_pair_through_a_drop_and_back():
    """The right device gives back 80 kN / (100 kN/mm) at the drop, and takes it again on the next rise."""
    dropping = envelope([(0, 0), (10, 100), (20, 20), (30, 200)], 50)
    other = envelope([(0, 0), (10, 300)], 100)
    pair, (left, right) = in_series(device(dropping), device(other))
    right = [0, 10 / 3, 10 / 3 - 0.8, 10 / 3, 20 / 3]
    assert (left * 1e3).tolist() == pytest.approx([0, 10, 20, 20 + 10 * 80 / 180, 30])
    assert ((pair.stroke - left) * 1e3).tolist() == pytest.approx(right)
    assert (pair.force / 1e3).tolist() == pytest.approx([0, 100, 20, 100, 200])


def test_a_pair_that_would_snap_back_drops_at_constant_stroke():
    sharp = envelope([(0, 0), (50, 1000), (50.2, 0), (100, 0), (101, 1500), (500, 1500)], 2000)
    soft = envelope([(0, 0), (400, 1200), (800, 1200)], 10)  # gives back 100 mm while the other goes 0.2 mm
    pair, _ = in_series(device(sharp), device(soft))
    assert (np.diff(pair.stroke) >= 0).all()
    drop = np.flatnonzero((pair.force[:-1] == 1000e3) & (pair.force[1:] == 0))
    assert drop.size == 1
    assert pair.stroke[drop[0]] == pair.stroke[drop[0] + 1]


def test_a_pair_that_has_snapped_goes_on_where_its_path_comes_back():
    """The sheared device meets its anti-climber before the pair is back at this stroke: there is force again."""
    sharp = envelope([(0, 0), (50, 1000), (50.2, 0), (60, 0), (160, 1500), (500, 1500)], 2000)
    soft = envelope([(0, 0), (400, 1200), (800, 1200)], 10)
    pair, (left, right) = in_series(device(sharp), device(soft))
    snapped = pair.stroke[np.argmax(pair.force == 1000e3)]
    for u in snapped + np.array([1e-6, 0.01, 0.05]):
        x, y = np.interp(u, pair.stroke, left), np.interp(u, pair.stroke, right)
        assert x + y == pytest.approx(u)
        assert pair.force_at(u) == pytest.approx(sharp.force_at(x), rel=1e-6)
        back = 1000e3 / 1200e3 * 0.4 - 1000e3 / 10e6  # the permanent set of the soft one
        assert pair.force_at(u) == pytest.approx(min(10e6 * (y - back), soft.force_at(y)), rel=1e-6)


def test_beyond_the_curves_the_device_that_has_ended_takes_the_stroke():
    """Past the pair's last point the weaker device goes on at its last force; the stronger one does not move."""
    weak, strong = envelope([(0, 0), (10, 500), (100, 500)], 1000), envelope([(0, 0), (10, 700), (100, 700)], 1000)
    front = joined(weak, strong)
    end = float(front.envelope.stroke[-1])
    strong_at_500 = 10 * 500 / 700 * 1e-3
    assert front.side_stroke(end + 0.3, 0) == pytest.approx(0.400)
    assert front.side_stroke(end + 0.3, 1) == pytest.approx(strong_at_500)
    assert joined(strong, weak).side_stroke(end + 0.3, 1) == pytest.approx(0.400)
    twin = joined(weak, weak)
    assert twin.side_stroke(0.2 + 0.3, 0) == twin.side_stroke(0.2 + 0.3, 1) == pytest.approx(0.25)
