"""Contact windows: known pulses, a second way to find the windows, and what is said of them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from builders import ALONG, pulses, scenario, values

from trainmj.collision.batch import run_chains
from trainmj.collision.fields import KEPT
from trainmj.collision.lineup import line_up
from trainmj.collision.result import Result
from trainmj.collision.simulation import run
from trainmj.collision.summary import Summary, summarise
from trainmj.errors import InputError
from trainmj.scenario import Scenario, load
from trainmj.single import tables
from trainmj.units import G

THRESHOLD = "simulation.contact_threshold_kN"

# known pulses


@pytest.mark.parametrize("step_ms", [0.001, 0.01, 0.1])
@pytest.mark.parametrize("threshold_kN", [0.001, 1.0, 20.0])
def test_half_a_sine(step_ms, threshold_kN):
    """1 t on a spring: breaks if the ends of a window are those of steps, or the impulse is that of other forces."""
    case = scenario([(0, 0), (50, 50_000)], 1.0, mass_t=[1.0], speed_m_s=1.0, step_ms=step_ms, time_limit_s=0.2)
    v = summarise(run(case.with_values({THRESHOLD: threshold_kN}))).vehicles[0]
    most, omega = math.sqrt(1e6 * 1e3), math.sqrt(1e6 / 1e3)
    start = math.asin(threshold_kN * 1e3 / most) / omega
    length = math.pi / omega - 2 * start
    mean = 2 * most * math.cos(omega * start) / omega / length / 1e3 / G
    (window,) = v.contacts
    assert (window.start_s, window.end_s) == pytest.approx((start, start + length), rel=1e-5, abs=1e-6)
    assert v.mean_deceleration_g == window.mean_g == v.worst_mean_deceleration_g == pytest.approx(mean, rel=1e-5)
    assert not window.cut


@pytest.mark.parametrize("step_ms", [0.01, 0.1])
def test_a_plateau_that_springs_back(step_ms):
    """500 kN stop 33 t, and a spring of 20 kN/mm gives back the rest: a jump at one end, a quarter of a cosine at the
    other.
    """
    mass, force, stiffness, v0 = 33e3, 500e3, 20e6, 3.0
    case = scenario([(0, 500), (900, 500)], stiffness / 1e6, speed_m_s=v0, step_ms=step_ms, time_limit_s=0.5)
    (window,) = summarise(run(case)).vehicles[0].contacts
    omega = math.sqrt(stiffness / mass)
    back = math.acos(1e3 / force) / omega
    climb = math.asin(force / (v0 * math.sqrt(stiffness * mass))) / omega
    left = v0 * math.cos(omega * climb)  # speed where the plateau begins
    start = math.asin(1e3 / (v0 * math.sqrt(stiffness * mass))) / omega
    length = climb - start + mass * left / force + back
    change = v0 * math.cos(omega * start) + force / mass / omega * math.sin(omega * back)
    assert window.end_s - window.start_s == pytest.approx(length, rel=1e-4)
    assert window.mean_g == pytest.approx(change / length / G, rel=1e-4)


TWO = [(1000.0, 100.0), (0.0, 20.0), (500.0, 200.0)]


def test_two_pulses_with_a_gap():
    """1 MN for 100 ms and 0.5 MN for 200 ms on 40 t: 2.54929 g and 1.27465 g, and means over 120 ms and the whole."""
    v = summarise(run(pulses(40.0, 9.0, TWO))).vehicles[0]
    assert [w.mean_g for w in v.contacts] == pytest.approx([2.54929, 1.27465], rel=1e-4)
    assert [w.start_s for w in v.contacts] == pytest.approx([0.0, 0.12], abs=2e-5)
    assert [w.end_s for w in v.contacts] == pytest.approx([0.1, 0.32], abs=2e-5)
    assert (v.mean_deceleration_g, v.worst_mean_deceleration_g) == (v.contacts[0].mean_g,) * 2
    assert v.mean_120ms_g == pytest.approx(2.12441, rel=1e-4)
    assert v.mean_100ms_g == pytest.approx(2.54929, rel=1e-4)
    assert v.front_mean_deceleration_g == pytest.approx(1.59331, rel=1e-4)


@pytest.mark.parametrize("step_ms", [0.01, 0.1])
def test_means_of_windows_hardly_depend_on_where_steps_meet_a_jump(step_ms):
    """Breaks if the step in which a force jumps counts as half of it: 1e-3 too little at the default step."""
    v = summarise(run(pulses(40.0, 9.0, TWO, step_ms=step_ms))).vehicles[0]
    assert [w.mean_g for w in v.contacts] == pytest.approx([2.54929, 1.27465], rel=1e-5)


def test_the_worst_window_is_a_later_one_and_a_short_one_is_none():
    """3 windows of 2 g for 20 ms, 0.5 g for 50 ms, 1 g for 40 ms."""
    force = 40.0 * G
    v = summarise(run(pulses(40.0, 9.0, [(2 * force, 20), (0, 20), (force / 2, 50), (0, 20), (force, 40)]))).vehicles[0]
    assert [w.mean_g for w in v.contacts] == pytest.approx([2.0, 0.5, 1.0], rel=1e-4)
    assert (v.mean_deceleration_g, v.worst_mean_deceleration_g) == pytest.approx((2.0, 1.0), rel=1e-4)


def test_the_partner_is_pushed_on_and_rail_friction_is_no_contact():
    """40 t into standing 20 t, on rails that hold: the same force, twice the mean, and nothing of the rails."""
    v = values([(0, 0), (1, 400), (900, 400)], 100, partner="u", speed_m_s=5.0, step_ms=0.01, time_limit_s=0.5)
    v["trains"] = {
        name: {"vehicles": [{"name": name, "mass_t": mass}], "front": "d"} for name, mass in (("t", 40), ("u", 20))
    }
    v["collision"]["rail_friction"] = 0.1
    summary = summarise(run(Scenario.from_values(v)))
    own, struck = summary.vehicles
    ((mine,), (other,)) = own.contacts, struck.contacts
    assert (mine.start_s, mine.end_s) == pytest.approx((other.start_s, other.end_s), rel=1e-12)
    assert struck.mean_deceleration_g == pytest.approx(2 * own.mean_deceleration_g, rel=1e-12)
    assert own.front_mean_deceleration_g > own.mean_deceleration_g + 0.09, "by all forces, rail friction with them"


# another way


def by_definition(time: np.ndarray, push: np.ndarray, threshold: float) -> Iterator[tuple[float, float, float]]:
    """Start, end and mean of every window, from the forces at all steps; one at the end of the run stops there."""

    def edge(outer: int, inner: int, beyond: int) -> tuple[float, float]:
        """Time and force where the line through the two outermost points of a window comes down to the threshold."""
        if not 0 <= beyond < len(time):
            return time[outer], push[outer]
        width = abs(time[beyond] - time[outer])
        rate = (push[inner] - push[outer]) / abs(time[inner] - time[outer]) if inside else 0.0
        away = (push[outer] - threshold) / rate if rate > 0 else math.inf
        away = min(away, width) if away < 2 * width else width / 2
        return time[outer] + math.copysign(away, beyond - outer), push[outer] - rate * away

    above = np.concatenate([[0], push > threshold, [0]]).astype(int)
    for a, end in zip(np.flatnonzero(np.diff(above) > 0), np.flatnonzero(np.diff(above) < 0), strict=True):
        b = end - 1
        inside = b > a
        points = [edge(a, a + 1, a - 1), *zip(time[a:end], push[a:end], strict=True), edge(b, b - 1, end)]
        t, f = np.array(points).T
        yield t[0], t[-1], np.trapezoid(f, t) / (t[-1] - t[0])


def expected(result: Result) -> dict[str, list[tuple[float, float, float]]]:
    """The windows of every vehicle, from its interface forces at every step."""
    chain, found = result.chain, {}
    for i, vehicle in enumerate(chain.vehicles):
        net = sum(
            (result.force[:, k] * ((face.right == i) - (face.left == i)) for k, face in enumerate(chain.interfaces)),
            np.zeros(len(result.time)),
        )
        push = -net if i < chain.n_moving else net
        windows = by_definition(result.time, push, chain.contact_threshold)
        found[vehicle.name] = [(start, end, mean / vehicle.mass / G) for start, end, mean in windows]
    return found


def compared(case: Scenario) -> Summary:
    """The numbers of a collision, after a comparison of all its windows and their means."""
    result = run(case.with_values({"simulation.record_every_ms": case.simulation.step_ms}))
    assert not result.chain.refined, "its smaller steps are not among the records"
    summary, windows = summarise(result), expected(result)
    for v in summary.vehicles:
        wanted = windows[v.name]
        assert v.contact_windows == len(wanted) <= KEPT
        found = [(w.start_s, w.end_s, w.mean_g) for w in v.contacts]
        assert np.array(found) == pytest.approx(np.array(wanted), rel=1e-9, abs=1e-9), v.name
        assert v.mean_deceleration_g == pytest.approx(wanted[0][2] if wanted else 0.0, rel=1e-9)
        lasting = [mean for start, end, mean in wanted if end - start >= 0.030]
        assert v.worst_mean_deceleration_g == pytest.approx(max(lasting, default=0.0), rel=1e-9)
    return summary


PULL = {f"devices.{name}.pull": {"stiffness_kN_per_mm": 50, "slack_mm": 5} for name in ("coupler_a_b", "coupler_c_d")}
BODIES = {"trains.b_type.body": {"stiffness_kN_per_mm": 1000, "members": 4, "collapse_force_kN": 900}}
MIXED = {
    "plain": {},
    "draw gear": PULL,
    "bodies": BODIES,
    "cut off": {"simulation.time_limit_s": 0.3},
    "both move": {"collision.partner_speed_km_h": -10},
    "a gap": {"collision.gap_mm": 30, THRESHOLD: 25},
}


@pytest.mark.parametrize("name", ALONG)
def test_windows_of_shipped_scenarios_are_those_of_the_definition(name):
    """Breaks if a step is left out of a window, a crossing is elsewhere, or a window is lost or invented."""
    compared(load(name))


@pytest.mark.thorough
@pytest.mark.parametrize("changes", MIXED.values(), ids=MIXED)
def test_windows_of_changed_scenarios_are_those_of_the_definition(changes):
    """Breaks where the forces within bodies count as contact, a pull as a push, or a cut window is closed."""
    compared(load("b_type", changes))


def test_what_a_body_carries_within_is_no_contact():
    """The windows are those of the interface forces on the vehicle, and their mean is over its whole mass."""
    summary = compared(load("b_type", BODIES))
    rigid = summarise(run(load("b_type")))
    assert summary.vehicles[0].mean_deceleration_g != rigid.vehicles[0].mean_deceleration_g
    assert summary.vehicles[5].mean_deceleration_g == pytest.approx(rigid.vehicles[5].mean_deceleration_g, rel=0.3)


def test_the_b_type_train():
    """Known numbers of M1 to M6, of contacts from the first newton on: they are by the devices alone."""
    own = summarise(run(load("b_type", {THRESHOLD: 0.001}))).vehicles[:6]
    found = [v.mean_deceleration_g for v in own]
    assert found == pytest.approx([1.160, 0.631, 0.520, 0.528, 0.540, 0.555], rel=3e-3)
    assert [v.mean_120ms_g for v in own] == pytest.approx([1.422, 1.067, 0.823, 0.694, 0.800, 0.953], abs=6e-4)


# what is said


def test_a_cut_window_is_told():
    """Breaks if a mean up to the time limit is taken for that of a whole window."""
    case = load("b_type", {"simulation.time_limit_s": 0.1})
    summary = summarise(run(case))
    first = summary.vehicles[0].contacts[-1]
    assert first.cut
    assert first.end_s == pytest.approx(0.1, rel=1e-9)
    assert summary.vehicles[-1].contacts == ()
    assert any("S5: in contact when the run ended; the last" in remark for remark in summary.remarks)
    assert np.isnan([v.mean_120ms_g for v in summary.vehicles]).all(), "no 120 ms are known"
    assert not np.isnan([v.mean_30ms_g for v in summary.vehicles]).any()
    assert not any("in contact when the run ended" in r for r in summarise(run(load("b_type"))).remarks)


def test_no_contact_is_no_deceleration():
    summary = summarise(run(load("b_type", {"collision.gap_mm": 100, "simulation.time_limit_s": 0.005})))
    for v in summary.vehicles:
        assert (v.mean_deceleration_g, v.worst_mean_deceleration_g, v.contact_windows) == (0.0, 0.0, 0.0)
        assert v.contacts == ()
    assert tables.contacts(summary) is None


def test_more_windows_than_are_kept():
    """The last but one of 108 is the worst that lasts: breaks if it is lost, or the first one is overwritten, or nobody
    says so.
    """
    short = [(50.0, 3.0), (0.0, 2.0)]
    case = pulses(100.0, 1.0, [(20.0, 35), (0, 2), *short * 105, (40.0, 31), (0, 2), (30.0, 40)], step_ms=0.01)
    summary = summarise(run(case))
    (v,) = summary.vehicles
    assert (v.contact_windows, len(v.contacts)) == (108, KEPT)
    assert [w.mean_g * G for w in v.contacts] == pytest.approx([0.2, *[0.5] * (KEPT - 2), 0.4], rel=1e-2)
    assert v.worst_mean_deceleration_g == v.contacts[-1].mean_g
    assert v.mean_deceleration_g == v.contacts[0].mean_g
    assert any(remark.startswith("M1 (108): more contact windows than are listed") for remark in summary.remarks)
    (batch,) = (other for _, other in run_chains([(0, line_up(case))]))
    assert batch.vehicles[0].contacts == v.contacts


def test_windows_are_listed():
    """In JSON all of them; in the report those of vehicles with several."""
    summary = summarise(run(load("b_type")))
    plain = summary.as_dict()["vehicles"][0]
    assert plain["contact_windows"] == len(plain["contacts"]) == 9
    assert set(plain["contacts"][0]) == {"start_s", "end_s", "mean_g", "cut"}
    table = tables.contacts(summary)
    assert [row[0] for row in table.rows if row[0]] == ["M1", "M2", "S1", "S2"]
    assert len(table.rows) == 26


def test_a_threshold_that_hides_a_light_vehicle_is_told():
    """1 kN is more than a g of 91 kg."""
    light = values([(0, 0), (50, 10)], 0.2, mass_t=[1.2], speed_m_s=1.0, step_ms=0.1, time_limit_s=0.1)
    said = "contact_threshold_kN = {} is more than 0.1 g"
    for threshold, told in ((1, False), (1.5, True)):
        case = Scenario.from_values(light).with_values({THRESHOLD: threshold})
        assert any(said.format(threshold) in r for r in summarise(run(case)).remarks) is told
    with pytest.raises(InputError, match=r"contact_threshold_kN = 2000.*divide by 1000"):
        load("b_type", {THRESHOLD: 2000})
    with pytest.raises(InputError, match="contact_threshold_kN = 0"):
        load("b_type", {THRESHOLD: 0})


def test_the_worst_window_can_be_limited():
    """M2 of the C-I case: 0.488 g in its first window, 0.94 g in a later one."""
    limits = {"limits": {"mean_deceleration_g": 0.8, "worst_mean_deceleration_g": 0.8}}
    first, worst = (c for c in summarise(run(load("en15227_c1", limits))).limits if c.of_scenario)
    assert first.kept
    assert not worst.kept
    assert worst.where == "M2"
