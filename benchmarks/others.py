"""The same collision computed in other ways, to compare with: plain Python, scipy, a bare compiled loop."""

from __future__ import annotations

from typing import Any

import mujoco
import numba
import numpy as np
from scipy.integrate import solve_ivp

from trainmj.collision.block import alone
from trainmj.collision.chain import Chain
from trainmj.collision.element import advance
from trainmj.collision.envelope import Envelope
from trainmj.collision.model import build


class PythonLaw:
    """The laws of the devices as they stand, not compiled, in a Python callback of MuJoCo; nothing else is tallied."""

    def __init__(self, chain: Chain) -> None:
        """For one simulation of a chain."""
        self.chain = chain
        self.elements = [[alone(e).tolist() for e in interface.elements] for interface in chain.interfaces]
        self.time = 0.0

    def __call__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """The passive forces of one step."""
        q, v, mass = data.qpos.tolist(), data.qvel.tolist(), data.M.tolist()
        net = [0.0] * len(v)
        elapsed, self.time = data.time - self.time, data.time
        for k, elements in enumerate(self.elements):
            u, rate = q[k] - q[k + 1], v[k] - v[k + 1]
            force = sum(advance(e, 0, u, rate, elapsed, data.time)[0] for e in elements)
            net[k] -= force
            net[k + 1] += force
        for i, limit in enumerate(self.chain.friction):
            net[i] += min(limit, max(-limit, -(mass[i] * v[i] / model.opt.timestep + net[i])))
        data.qfrc_passive[:] += net

    def run(self, steps: int) -> None:
        """Step a simulation of the chain."""
        model = build(self.chain, bare=True)
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        before = mujoco.get_mjcb_passive()
        mujoco.set_mjcb_passive(self)
        try:
            mujoco.mj_step(model, data, nstep=steps)
        finally:
            mujoco.set_mjcb_passive(before)


def crushed(chain: Chain) -> tuple[list[Envelope], np.ndarray]:
    """The curve of each interface of a chain of crush devices, and the part of its stroke that it takes."""
    elements = [element for interface in chain.interfaces for element in interface.elements]
    assert len(elements) == len(chain.interfaces)
    assert all(len(element.laws) == 1 and element.laws[0].kind.name == "crush" for element in elements)
    return [element.laws[0].loading for element in elements], np.array([element.share for element in elements])


def by_scipy(chain: Chain, until: float, rtol: float, method: str = "RK45") -> np.ndarray:
    """Largest strokes [m] by solve_ivp, with an event wherever an interface starts or stops being crushed.

    Rises steeper than the unloading stiffness are climbed along it, and rail friction is smoothed below 1 mm/s.
    """
    n = len(chain.vehicles)
    mass, limit = chain.mass, chain.friction
    envelopes, share = crushed(chain)
    curves = [_climbable(envelope) for envelope in envelopes]
    stiffness = np.array([envelope.stiffness for envelope in envelopes])
    damping = np.array([envelope.damping for envelope in envelopes])
    m = len(curves)
    crushing = np.zeros(m, dtype=bool)
    plastic, most = np.zeros(m), np.zeros(m)

    def crush(u: np.ndarray) -> np.ndarray:
        return np.array([np.interp(x, *curve) for x, curve in zip(u, curves, strict=True)])

    def motion(_: float, y: np.ndarray) -> np.ndarray:
        u, rate = share * (y[: n - 1] - y[1:n]), share * (y[n:-1] - y[n + 1 :])
        elastic = stiffness * (u - plastic)
        envelope = crush(u)
        force = np.where(elastic > 0, np.clip(elastic + damping * rate, 0.0, envelope), 0.0)
        force = np.where(crushing, envelope, force)
        net = np.append(0.0, force) - np.append(force, 0.0)
        return np.concatenate([y[n:], (net - limit * np.tanh(y[n:] / 1e-3)) / mass])

    def switch(k: int) -> Any:
        def stops(_: float, y: np.ndarray) -> float:
            return y[n + k] - y[n + k + 1] + 1e-6  # a little late, so that rest is no event

        def starts(_: float, y: np.ndarray) -> float:
            u = share[k] * (y[k] - y[k + 1])
            return stiffness[k] * (u - plastic[k]) - np.interp(u, *curves[k]) - 1.0

        event = stops if crushing[k] else starts
        event.terminal, event.direction = True, -1.0 if crushing[k] else 1.0
        return event

    t, y = 0.0, np.concatenate([chain.start, chain.speed])
    crushing[chain.front] = chain.gap == 0.0
    while t < until:
        events = [switch(k) for k in range(m)]
        found = solve_ivp(motion, (t, until), y, method, events=events, rtol=rtol, atol=1e-7, max_step=5e-3)
        u = found.y[: n - 1] - found.y[1:n]
        most = np.maximum(most, u.max(axis=1))
        t, y = float(found.t[-1]), found.y[:, -1]
        for k, times in enumerate(found.t_events):
            if len(times):
                u_now = share[k] * (y[k] - y[k + 1])
                if crushing[k]:
                    plastic[k] = u_now - np.interp(u_now, *curves[k]) / stiffness[k]
                crushing[k] = not crushing[k]
        t = min(until, t + 1e-12)
    return most


def _climbable(envelope: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points of an envelope in which no rise is steeper than the unloading stiffness."""
    fine = np.unique(np.concatenate([envelope.stroke, np.linspace(0, envelope.stroke[-1], 20_001)]))
    force = np.array([envelope.force_at(u) for u in fine])
    for k in range(1, fine.size):
        force[k] = min(force[k], force[k - 1] + envelope.stiffness * (fine[k] - fine[k - 1]))
    bent = np.flatnonzero(np.abs(np.diff(np.diff(force) / np.diff(fine))) > 1.0) + 1
    keep = np.concatenate([[0], bent, [fine.size - 1]])
    return fine[keep], force[keep]


@numba.njit(cache=True)  # type: ignore[misc]
def bare_loop(
    mass: np.ndarray,
    limit: np.ndarray,
    q: np.ndarray,
    v: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
    share: np.ndarray,
    curves: np.ndarray,
    step: float,
    steps: int,
) -> np.ndarray:
    """Largest strokes [m] by the same equations and steps in one compiled loop, without an engine."""
    n, m = mass.size, stiffness.size
    plastic, most = np.zeros(m), np.zeros(m)
    segment = np.zeros(m, np.int64)
    for _ in range(steps):
        behind, held = 0.0, 0.0
        for i in range(n):
            ahead = 0.0
            if i < m:
                u, rate = share[i] * (q[i] - q[i + 1]), share[i] * (v[i] - v[i + 1])
                elastic = stiffness[i] * (u - plastic[i])
                if elastic > 0.0:
                    k = segment[i]
                    while k > 0 and u < curves[i, 0, k]:
                        k -= 1
                    while k + 1 < curves.shape[2] and u >= curves[i, 0, k + 1]:
                        k += 1
                    segment[i] = k
                    crush = curves[i, 1, k] + curves[i, 2, k] * (u - curves[i, 0, k])
                    if elastic >= crush:
                        ahead = crush
                        plastic[i] = u - crush / stiffness[i]
                    else:
                        ahead = min(crush, max(0.0, elastic + damping[i] * rate))
                most[i] = max(most[i], u / share[i])
            net = behind - ahead
            behind = ahead
            friction = min(limit[i], max(-limit[i], -(mass[i] * v[i] / step + net)))
            # v[i] is moved when the vehicle in front has used it: the loop looks one ahead only
            if i > 0:
                v[i - 1] = held
            held = v[i] + step * (net + friction) / mass[i]
        v[n - 1] = held
        q += step * v
    return most


def loop_arguments(chain: Chain, step: float, steps: int) -> tuple[Any, ...]:
    """What bare_loop takes for a chain and so many steps [s]."""
    envelopes, share = crushed(chain)
    curves = np.full((len(envelopes), 3, max(e.stroke.size for e in envelopes)), np.inf)
    for curve, e in zip(curves, envelopes, strict=True):
        curve[:, : e.stroke.size] = e.stroke, e.force, e.slope
    return (
        chain.mass,
        chain.friction,
        chain.start.copy(),
        chain.speed.copy(),
        np.array([e.stiffness for e in envelopes]),
        np.array([e.damping for e in envelopes]),
        share,
        curves,
        step,
        steps,
    )


def ts_of(chain: Chain, strokes: np.ndarray) -> float:
    """TS [m] of a train that meets its twin, from the largest strokes of all interfaces [m]."""
    front = chain.interfaces[chain.front]
    stages = front.devices[0].stages
    return float(strokes[: chain.front].sum() + sum(stage.stroke(strokes[chain.front] / 2) for stage in stages))
