"""Collisions whose outcome is known without this program: closed forms, symmetries, conservation, other integrators."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from builders import chain, device, envelope, scenario
from scipy.integrate import solve_ivp

from trainmj import native
from trainmj.batch import run_chains
from trainmj.chain import Chain, largest_step, line_up
from trainmj.device import Array, Envelope, in_series
from trainmj.layout import Joint, Layout
from trainmj.metrics import Summary, summarise
from trainmj.model import build
from trainmj.result import Result
from trainmj.scenario import load
from trainmj.simulation import run, start

FINE = 1e-4  # what the closed forms are met to, relative; most are met far better


def collide(*cases: Chain) -> list[Summary]:
    return [summary for _, summary in sorted(run_chains(enumerate(cases)), key=lambda item: item[0])]


def replayed(name: str = "b_type", **changes: Any) -> Chain:
    return line_up(load(name, changes))


# closed forms


def test_hooke_wall():
    """1000 kg at 1 m/s onto 1e6 N/m: F = v sqrt(k m), u = v sqrt(m / k), contact pi sqrt(m / k), speed returned."""
    tally = run(scenario([(0, 0), (1000, 1e6)], 1.0, mass_t=[1.0], speed_m_s=1.0, time_limit_s=0.2)).tally
    assert tally.force_max[0] == pytest.approx(31_622.777, rel=FINE)
    assert tally.stroke_max[0] == pytest.approx(0.031622777, rel=FINE)
    assert tally.last_force_time[0] - tally.first_force_time[0] == pytest.approx(0.0993459, rel=FINE)
    assert tally.speed[0] == pytest.approx(-1.0, rel=FINE)
    assert tally.plastic[0] == 0.0


ELASTO_PLASTIC = (
    [(0, 0), (10, 800), (1000, 800)],
    80.0,
)  # per train; the pair has 4e7 N/m


@pytest.mark.parametrize("idle", ["none", "gap", "empty stroke"])
def test_two_masses_ideal_elasto_plastic(idle):
    """33 t each, k = 4e7 N/m, F_y = 800 kN, 3 m/s; 50 mm of travel without force change when, not what, happens."""
    points, stiffness = ELASTO_PLASTIC
    collision = {"gap_mm": 50.0} if idle == "gap" else {}
    case = scenario(points, stiffness, partner="t", speed_m_s=3.0, collision=collision, time_limit_s=0.3)
    if idle == "empty stroke":
        case = case.with_values({"devices.d.empty_stroke_mm": 25.0})  # of each train
    result = run(case)
    summary, tally = summarise(result), result.tally
    more = 0.050 if idle == "empty stroke" else 0.0
    assert tally.stroke_max[0] == pytest.approx(0.1028125 + more, rel=FINE)
    assert tally.plastic[0] == pytest.approx(0.0828125 + more, rel=FINE)
    assert tally.speed[1] - tally.speed[0] == pytest.approx(0.984732, rel=FINE)
    assert 2 * summary.interfaces[0].energy_kJ == pytest.approx(66.250, rel=FINE), "the front is reported per train"
    assert tally.first_force_time[0] == pytest.approx(0.0 if idle == "none" else 0.050 / 3.0, abs=2e-6)
    assert summary.TS_mm == pytest.approx(102.8125 / 2, rel=FINE), "TS does not count empty strokes"


@pytest.mark.parametrize("n_wagons", [2, 5])
def test_perfectly_plastic_chain_ends_at_the_common_speed(n_wagons):
    """Plateaus without spring: what is lost is the kinetic energy about the common centre of mass."""
    e = envelope([(0, 0), (0.01, 500), (9000, 500)], 1e5)
    case = chain([20e3] * n_wagons, [e] * (n_wagons - 1), [5.0] + [0.0] * (n_wagons - 1), step=2e-5, time_limit=3.0)
    (summary,) = collide(case)
    lost = 0.5 * 20e3 * 5.0**2 * (1 - 1 / n_wagons) / 1e3
    assert summary.balance.absorbed_kJ == pytest.approx(lost, rel=1e-4)
    assert [v.final_speed_km_h for v in summary.vehicles] == pytest.approx([18.0 / n_wagons] * n_wagons, rel=0.02)


def test_standard_case_has_the_initial_energy_and_common_speed_of_its_masses():
    """6 x 33 t at 25 km/h: 4774.306 kJ; without rail friction 3.47222 m/s in common and 2387.153 kJ lost."""
    (summary,) = collide(replayed(**{"collision.rail_friction": 0}))
    assert summary.balance.kinetic_start_kJ == pytest.approx(4774.306, abs=5e-4)
    mean = np.mean([v.final_speed_km_h for v in summary.vehicles]) / 3.6
    assert mean == pytest.approx(3.47222, abs=5e-6)
    assert summary.balance.absorbed_kJ == pytest.approx(2387.153, rel=2e-3), "the vehicles part at a few cm/s"


# other integrators and engines


def test_mujocos_own_plastic_springs():
    """MuJoCo's springyield tendons are ideal elasto-plastic: no code of this project is in that model."""
    xml = """<mujoco><option timestep="1e-5">
      <flag gravity="disable" contact="disable" constraint="disable" eulerdamp="disable"/></option>
      <worldbody>
        <body><joint name="a" type="slide" axis="1 0 0"/><inertial mass="33000" pos="0 0 0" diaginertia="1 1 1"/></body>
        <body><joint name="b" type="slide" axis="1 0 0"/><inertial mass="21000" pos="0 0 0" diaginertia="1 1 1"/></body>
        <body><joint name="c" type="slide" axis="1 0 0"/><inertial mass="47000" pos="0 0 0" diaginertia="1 1 1"/></body>
      </worldbody>
      <tendon>
        <fixed stiffness="4e7" springyield="0.02"><joint joint="a" coef="1"/><joint joint="b" coef="-1"/></fixed>
        <fixed stiffness="6e7" springyield="0.01"><joint joint="b" coef="1"/><joint joint="c" coef="-1"/></fixed>
      </tendon></mujoco>"""
    theirs = mujoco.MjModel.from_xml_string(xml)
    their_data = mujoco.MjData(theirs)
    their_data.qvel[0] = 3.0
    devices = [envelope([(0, 0), (20, 800), (2000, 800)], 40), envelope([(0, 0), (10, 600), (2000, 600)], 60)]
    case = chain([33e3, 21e3, 47e3], devices, [3.0, 0.0, 0.0], step=1e-5)
    ours, layout = build(case), Layout.of(case)
    our_data = start(ours, case, layout)
    compared, plastic = 0, 0.0
    with native.installed():
        while True:
            mujoco.mj_step(theirs, their_data)
            mujoco.mj_step(ours, our_data)
            if our_data.time > 1e-3 and (layout.joint(our_data.userdata, Joint.FORCE) <= 0).any():
                break  # from here on their springs pull, devices do not
            assert our_data.qpos == pytest.approx(their_data.qpos, rel=1e-9, abs=1e-12)
            assert our_data.qvel == pytest.approx(their_data.qvel, rel=1e-9, abs=1e-9)
            compared += 1
            plastic = float(layout.joint(our_data.userdata, Joint.PLASTIC).min())
    assert compared > 1000
    assert plastic > 0.001, "both springs must have yielded while they were compared"


def peaks_by_scipy(mass: list[float], envelopes: list[Envelope], speed: list[float], until: float) -> dict[str, Array]:
    """An independent solution: each interface loads along its curve or unloads from its largest stroke.

    The phases are switched by the events of an adaptive Runge-Kutta method of order 8.
    """
    n, m = len(mass), len(envelopes)
    inverse = 1.0 / np.array(mass)
    top = np.zeros(m)  # largest stroke of each interface
    loading = np.ones(m, dtype=bool)
    peak = np.zeros(m)

    def forces(y: Array) -> Array:
        u, rate = y[: n - 1] - y[1:n], y[n : 2 * n - 1] - y[n + 1 :]
        out = np.zeros(m)
        for k, e in enumerate(envelopes):
            if loading[k]:
                out[k] = np.interp(u[k], e.stroke, e.force) if u[k] > 0 else 0.0
            else:
                elastic = np.interp(top[k], e.stroke, e.force) - e.stiffness * (top[k] - u[k])
                out[k] = max(0.0, elastic + e.damping * rate[k]) if elastic > 0 else 0.0
        return out

    def motion(_: float, y: Array) -> Array:
        f = forces(y)
        net = np.concatenate([[0.0], f]) - np.concatenate([f, [0.0]])
        return np.concatenate([y[n:], net * inverse])

    def event(k: int) -> Any:
        def switch(_: float, y: Array) -> float:
            return y[n + k] - y[n + k + 1] if loading[k] else y[k] - y[k + 1] - top[k]

        switch.terminal = True  # type: ignore[attr-defined]
        switch.direction = -1 if loading[k] else 1  # type: ignore[attr-defined]
        return switch

    t, y = 0.0, np.concatenate([np.zeros(n), speed])
    while t < until:
        events = [event(k) for k in range(m)]
        s = solve_ivp(motion, (t, until), y, "DOP853", events=events, rtol=1e-10, atol=1e-12, max_step=1e-3)
        for row in s.y.T:
            peak = np.maximum(peak, forces(row))
        t, y = float(s.t[-1]), s.y[:, -1]
        if s.status == 1:
            k = next(i for i, times in enumerate(s.t_events) if len(times))
            if loading[k]:
                top[k] = y[k] - y[k + 1]
            loading[k] = not loading[k]
    return {"top": top, "peak": peak, "speed": y[n:]}


@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_three_masses_by_scipy(damping):
    """An unequal chain that loads, unloads and loads again, against scipy's DOP853 with events."""
    mass, speed = [33e3, 20e3, 41e3], [4.0, 0.0, 0.0]
    devices = [
        envelope([(0, 0), (20, 700), (600, 900)], 80, damping),
        envelope([(0, 0), (73, 500), (300, 1100)], 50, damping),
    ]
    oracle = peaks_by_scipy(mass, devices, speed, 0.4)
    result = collide_tally(chain(mass, devices, speed, step=2e-6, time_limit=0.4))
    assert result["top"] == pytest.approx(oracle["top"], rel=FINE)
    assert result["peak"] == pytest.approx(oracle["peak"], rel=FINE)
    assert result["speed"] == pytest.approx(oracle["speed"], rel=FINE)


def collide_tally(case: Chain) -> dict[str, Array]:
    model, layout = build(case, bare=True), Layout.of(case)
    data = start(model, case, layout)
    with native.installed():
        mujoco.mj_step(model, data, nstep=round(case.time_limit / case.step))
    tally = {"top": Joint.STROKE_MAX, "peak": Joint.FORCE_MAX}
    return {k: layout.joint(data.userdata, f).copy() for k, f in tally.items()} | {"speed": data.qvel.copy()}


# symmetries


def vehicle_numbers(summary: Summary, side: str) -> Array:
    return np.array(
        [
            [v.peak_device_acceleration_g, v.mean_30ms_g, v.cfc60_peak_g, v.balance_time_s]
            for v in summary.vehicles
            if v.name.startswith(side)
        ]
    )


def interface_numbers(summary: Summary, n: int = 6) -> Array:
    return np.array([[i.stroke_mm, i.permanent_mm, i.peak_force_kN, i.energy_kJ] for i in summary.interfaces[:n]])


def test_standing_twin_equals_half_the_speed_against_a_rigid_wall():
    """Without rail friction, vehicle by vehicle (Yao et al. 2019)."""
    frictionless = {"collision.rail_friction": 0}
    twin, wall = collide(replayed(**frictionless), replayed("b_type_wall", **frictionless))
    assert interface_numbers(twin) == pytest.approx(interface_numbers(wall), rel=1e-6, abs=1e-6)
    assert vehicle_numbers(twin, "M") == pytest.approx(vehicle_numbers(wall, "M"), rel=1e-6)
    assert vehicle_numbers(twin, "S") == pytest.approx(vehicle_numbers(wall, "M"), rel=1e-6), "both trains fare alike"
    assert (twin.TS_mm, twin.TAMA_g) == pytest.approx((wall.TS_mm, wall.TAMA_g), rel=1e-6)
    assert twin.interfaces[0].stroke_mm > 500, "the anti-climbers must have met, or little is compared"


@pytest.mark.parametrize("more", [-25.0, -12.5, 30.0])
def test_adding_one_speed_to_all_vehicles_changes_nothing(more):
    """Galilean invariance; with rail friction it would not hold."""
    still, moving = collide(
        replayed(**{"collision.rail_friction": 0}),
        replayed(
            **{
                "collision.rail_friction": 0,
                "collision.speed_km_h": 25 + more,
                "collision.partner_speed_km_h": more,
            }
        ),
    )
    assert interface_numbers(moving, 11) == pytest.approx(interface_numbers(still, 11), rel=1e-8, abs=1e-7)
    for side in "MS":
        assert vehicle_numbers(moving, side) == pytest.approx(vehicle_numbers(still, side), rel=1e-8)
    final = [[v.final_speed_km_h for v in s.vehicles] for s in (still, moving)]
    assert np.array(final[1]) - more == pytest.approx(np.array(final[0]), rel=1e-8, abs=1e-7)


def test_seen_in_a_mirror_the_collision_is_the_same():
    """A sign mistake on one side only, in the law or in rail friction, would show here."""
    case = replayed("b_type_scenario_2")
    n = len(case.vehicles)
    image = replace(
        case,
        vehicles=tuple(replace(v, speed=-v.speed) for v in case.vehicles[::-1]),
        interfaces=tuple(replace(i, left=k, right=k + 1) for k, i in enumerate(case.interfaces[::-1])),
        n_moving=n - case.n_moving,
    )
    for field, seen in collide_tally(case).items():
        mirrored = collide_tally(image)[field][::-1]
        assert seen == pytest.approx(-mirrored if field == "speed" else mirrored, rel=1e-9, abs=1e-12), field


def test_a_model_at_one_eighth_scale_has_strokes_of_one_eighth():
    """Similitude as in Shao et al. 2016: lengths / 8, forces / 64, masses / 512, times / 8, speeds equal.

    Rail friction scales as the forces only if its coefficient is 8 times larger. All factors are powers of two.
    """
    full = replace(replayed("en15227_c1"), time_limit=2.0)
    interfaces = []
    for i in full.interfaces:
        e = Envelope(i.envelope.stroke / 8, i.envelope.force / 64, i.envelope.stiffness / 8, i.envelope.damping / 64)
        interfaces.append(replace(i, envelope=e, left_stroke=i.left_stroke / 8))
    model = replace(
        full,
        vehicles=tuple(replace(v, mass=v.mass / 512, length=v.length / 8) for v in full.vehicles),
        interfaces=tuple(interfaces),
        rail_friction=8 * full.rail_friction,
        step=full.step / 8,
        time_limit=full.time_limit / 8,
    )
    large, small = collide_tally(full), collide_tally(model)
    assert 8 * small["top"] == pytest.approx(large["top"], rel=1e-12)
    assert 64 * small["peak"] == pytest.approx(large["peak"], rel=1e-12)
    assert small["speed"] == pytest.approx(large["speed"], rel=1e-12)


# conservation


def test_momentum_is_kept_to_round_off_without_friction():
    (summary,) = collide(replayed(**{"collision.rail_friction": 0}))
    assert abs(summary.balance.momentum_error) <= 1e-9
    kept = sum(v.mass_t * v.final_speed_km_h for v in summary.vehicles)
    assert kept == pytest.approx(6 * 33 * 25, rel=1e-9), "and not only by the program's own account"


@pytest.mark.parametrize("name", ["b_type", "b_type_scenario_2", "b_type_wall", "wagon_80t", "en15227_c1"])
def test_balances_close_on_every_shipped_scenario(name):
    balance = collide(replayed(name))[0].balance
    assert abs(balance.energy_error) <= 1e-3
    assert abs(balance.momentum_error) <= 1e-9, "rails and wall take what the vehicles lose"
    parts = balance.kinetic_end_kJ + balance.elastic_kJ + balance.absorbed_kJ + balance.friction_kJ
    assert parts == pytest.approx(balance.kinetic_start_kJ, rel=1e-3)


@pytest.fixture(scope="module")
def every_step() -> Result:
    """The standard collision with every step on record."""
    return run(load("b_type", {"simulation.record_every_ms": 0.1}))


def dissipated(e: Envelope, stroke: Array, rate: Array) -> tuple[float, float]:
    """What a device loses along a history, counted from its law, and what is left in its spring [J].

    The work that the tally counts closes the balance of the integrator by construction (summation by parts), whatever
    the step; this account does not know the equations of motion.
    """
    plastic, before, lost = 0.0, 0.0, 0.0
    for n, u in enumerate(stroke):
        force, moved = e.respond(float(u), float(rate[n]), plastic)
        if moved > plastic:
            lost += force * (moved - plastic)
        elif force > 0.0 and n:
            lost += (force - e.stiffness * (u - plastic)) * (u - before)
        plastic, before = moved, float(u)
    return lost, 0.5 * e.stiffness * max(0.0, float(stroke[-1]) - plastic) ** 2


def test_energy_balance_of_the_standard_case_by_an_account_of_its_own(every_step):
    """<= 1e-3 of the initial kinetic energy at the default step: speeds against what devices and rails lose."""
    chain_, r = every_step.chain, every_step
    kinetic = 0.5 * (chain_.mass * r.velocity**2).sum(axis=1)
    losses = [dissipated(i.envelope, r.stroke[:, k], r.stroke_rate[:, k]) for k, i in enumerate(chain_.interfaces)]
    devices = sum(a + b for a, b in losses)
    rails = float((chain_.friction * np.trapezoid(np.abs(r.velocity), r.time, axis=0)).sum())
    error = (kinetic[0] - kinetic[-1] - devices - rails) / kinetic[0]
    assert abs(error) <= 1e-3
    each = np.array([a for a, _ in losses]) / 1e3
    assert each == pytest.approx(r.energy[-1] / 1e3, rel=2e-3, abs=0.05), "interface by interface, in kJ"


def test_absorbed_energy_is_the_area_under_the_curve():
    """Without dashpots: loading along the curve, less what the spring gives back."""
    case = replayed("en15227_c1", **{"collision.speed_km_h": 20})
    result = run(load("en15227_c1", {"collision.speed_km_h": 20}))
    for k, interface in enumerate(case.interfaces):
        e, top = interface.envelope, float(result.tally.stroke_max[k])
        area = e.energy(top) - 0.5 * e.force_at(top) ** 2 / e.stiffness
        assert result.energy[-1, k] == pytest.approx(area, rel=2e-3, abs=50.0), interface.name


# rail friction


@pytest.mark.parametrize("mu", [0.008, 0.1])
def test_a_coasting_vehicle_stops_after_v2_over_2_mu_g(mu):
    e = envelope([(0, 0), (100, 1000)], 100)
    v, distance = 2.0, 2.0**2 / (2 * mu * 9.80665)
    case = chain([33e3], [e], [v], friction=mu, step=1e-4, gap=2 * distance)
    model = build(case, bare=True)
    data = start(model, case, Layout.of(case))
    with native.installed():
        mujoco.mj_step(model, data, nstep=round(1.1 * v / (mu * 9.80665) / 1e-4))
        stopped = float(data.qpos[0])
        mujoco.mj_step(model, data, nstep=5000)
    assert stopped - case.start[0] == pytest.approx(distance, rel=FINE)
    assert data.qpos[0] == pytest.approx(stopped, abs=1e-12), "once it stands it stays"
    assert abs(data.qvel[0]) < 1e-12


def test_a_standing_vehicle_stands_until_pushed_harder_than_mu_m_g():
    soft = envelope([(0, 0), (100, 100), (5000, 100)], 50)  # pushes with 100 kN at most
    held = chain([10e3, 47e3], [soft], [3.0, 0.0], friction=0.22, step=1e-4, time_limit=1.0)  # stands against 101.4 kN
    freed = chain([10e3, 47e3], [soft], [3.0, 0.0], friction=0.21, step=1e-4, time_limit=1.0)  # against 96.8 kN
    moved = []
    for case in (held, freed):
        model = build(case, bare=True)
        data = start(model, case, Layout.of(case))
        with native.installed():
            mujoco.mj_step(model, data, nstep=10_000)
        assert Layout.of(case).joint(data.userdata, Joint.FORCE_MAX)[0] == 100e3
        moved.append(abs(float(data.qpos[1])))
    assert moved[0] < 1e-12, "pushed by less it must not creep"
    assert moved[1] > 1e-5, "pushed by more it must give way"


# the step


def test_order_of_convergence():
    """Errors of strokes and speeds fall with the step, at first order or better."""
    steps = np.array([0.2, 0.1, 0.05, 0.025, 0.0125]) * 1e-3
    elastic = [envelope([(0, 0), (500, 5000)], 10), envelope([(0, 0), (500, 8000)], 16)]
    smooth = chain([33e3, 20e3, 41e3], elastic, [2.0, 0.0, 0.0], time_limit=0.15)
    for case in (smooth, replace(replayed(), time_limit=0.6)):
        exact = collide_tally(replace(case, step=0.5e-6 if case is smooth else 1e-6))
        for field in ("top", "speed"):
            errors = [
                float(np.linalg.norm(collide_tally(replace(case, step=float(h)))[field] - exact[field])) for h in steps
            ]
            order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
            assert order > 0.9, f"order {order:.2f} of {field}: {errors}"


@pytest.fixture(scope="module")
def steps() -> tuple[Summary, Summary]:
    """The standard case at the default step and at a twentieth of it."""
    default, fine = collide(replayed(), replayed(**{"simulation.step_ms": 0.005}))
    return default, fine


def test_default_step_is_converged(steps):
    """The step moves the criteria by less than the bars against the paper allow, so that it is not a fitted number."""
    default, fine = steps
    assert default.TS_mm == pytest.approx(fine.TS_mm, rel=1e-4)
    assert interface_numbers(default, 11) == pytest.approx(interface_numbers(fine, 11), rel=3e-2, abs=0.5)
    for x, y in zip(default.vehicles[1:6], fine.vehicles[1:6], strict=True):
        assert x.peak_device_acceleration_g == pytest.approx(y.peak_device_acceleration_g, abs=0.01), x.name


def test_peak_acceleration_of_the_head_car_does_not_depend_on_the_step(steps):
    default, fine = steps
    assert default.vehicles[0].peak_device_acceleration_g == pytest.approx(
        fine.vehicles[0].peak_device_acceleration_g, abs=1e-3
    )
    assert default.TAMA_g == pytest.approx(fine.TAMA_g, rel=1.5e-3)


@pytest.mark.parametrize("name", ["b_type", "b_type_wall", "wagon_80t"])
def test_largest_step_is_stable_and_not_far_from_where_stability_ends(name):
    """The linear map of one step, every interface on its elastic branch: its largest eigenvalue must not pass 1."""
    case = replayed(name)
    n = len(case.vehicles)
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    for i in case.interfaces:
        pull = np.zeros(n)
        pull[i.left] = 1.0
        if i.right >= 0:
            pull[i.right] = -1.0
        stiffness += i.envelope.stiffness * np.outer(pull, pull) / case.mass[:, None]
        damping += i.envelope.damping * np.outer(pull, pull) / case.mass[:, None]

    def radius(h: float) -> float:
        speed = np.hstack([-h * stiffness, np.eye(n) - h * damping])
        place = np.hstack([np.eye(n), np.zeros((n, n))]) + h * speed
        return float(np.abs(np.linalg.eigvals(np.vstack([place, speed]))).max())

    limit = largest_step(case)
    assert radius(limit) < 1 + 1e-6
    assert radius(3 * limit) > 1 + 1e-6, "a bound far too small would refuse good steps"


def test_a_pair_in_series_is_two_devices_with_a_light_body_between():
    """What in_series claims, simulated: the same force and stroke when a thin plate of 100 kg parts the two."""
    e = envelope([(0, 0), (50, 600), (200, 900), (600, 900)], 40)
    other = envelope([(0, 0), (30, 700), (300, 800), (900, 1200)], 70)
    pair, _ = in_series(device(e), device(other))
    parted = collide_tally(chain([33e3, 100.0, 33e3], [e, other], [4.0, 2.0, 0.0], step=1e-6, time_limit=0.15))
    joined = collide_tally(chain([33e3, 33e3], [pair], [4.0, 0.0], step=1e-6, time_limit=0.15))
    assert float(parted["top"].sum()) == pytest.approx(float(joined["top"][0]), rel=0.01)
    assert parted["peak"].max() == pytest.approx(joined["peak"][0], rel=0.05)
