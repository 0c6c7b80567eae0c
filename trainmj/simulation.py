"""One collision, headless: build the model, step it until the collision is over, keep what its sensors say."""

from __future__ import annotations

from importlib.metadata import version

import mujoco
import numpy as np

from trainmj import native
from trainmj.chain import Chain, line_up
from trainmj.device import Array
from trainmj.errors import EngineError, InputError
from trainmj.layout import Head, Layout
from trainmj.model import build, split_sensors
from trainmj.result import Result, Tally
from trainmj.scenario import Scenario


def run(scenario: Scenario) -> Result:
    """Compute one collision.

    The run ends when no device carries force and none comes closer, or all vehicles stand, or at the time limit.

    Args:
        scenario: what to collide.

    Returns:
        Histories at the recorded times and the tally of every step.

    Raises:
        InputError: if the step is too large for the stiffest device and the lightest vehicle.
        EngineError: if the running MuJoCo cannot carry the device law, or something replaced it.
    """
    chain = line_up(scenario)
    check_step(chain)
    layout = Layout.of(chain)
    model = build(chain, layout)
    data = start(model, chain, layout)
    with native.installed():
        logged = _log(model, data, chain)
    return Result(
        scenario,
        chain,
        Tally.of(layout, data.userdata),
        time=record_times(len(logged), chain),
        **split_sensors(chain, logged),
        versions=versions(),
    )


def start(model: mujoco.MjModel, chain: Chain, layout: Layout) -> mujoco.MjData:
    """A simulation at the start: speeds set, devices unused."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.userdata[:] = layout.block(chain)
    return data


def largest_step(chain: Chain) -> float:
    """Largest stable step of a chain [s].

    For an oscillator of circular frequency w and damping ratio z the semi-implicit Euler step with an explicit
    dashpot is stable below 2 (sqrt(1 + z2) - z) / w. The bound takes each interface on its elastic branch between its
    two vehicles, both of them held by another interface as stiff.
    """
    steps = []
    mass = chain.mass
    for interface in chain.interfaces:
        inverse = 1.0 / mass[interface.left] + (1.0 / mass[interface.right] if interface.right >= 0 else 0.0)
        w2 = 2.0 * interface.envelope.stiffness * inverse
        damping = interface.envelope.damping * inverse  # half of 2 c / m
        steps.append(float(2.0 / (damping + np.sqrt(damping**2 + w2))))
    return min(steps)


def check_step(chain: Chain) -> None:
    """Refuse a step at which the integration is not stable.

    Raises:
        InputError: naming the largest step.
    """
    limit = largest_step(chain)
    if chain.step > limit:
        raise InputError(
            f"simulation.step_ms = {chain.step * 1e3:g}: must be at most {limit * 1e3:.3g} ms for the stiffness and "
            "damping of these devices and the mass of these vehicles, or the integration is unstable"
        )


def versions() -> dict[str, str]:
    """Versions of what computes a result."""
    return {name: version(name) for name in ("trainmj", "mujoco", "numba", "numpy")}


def n_records(chain: Chain) -> int:
    """Most samples a run of a chain can record."""
    return int(np.ceil(chain.time_limit / (chain.step * chain.steps_per_record) - 1e-9)) + 1


def record_times(n: int, chain: Chain) -> Array:
    """(n,) times of the first n samples of a run [s]."""
    return np.asarray(np.arange(n) * (chain.step * chain.steps_per_record))


def _log(model: mujoco.MjModel, data: mujoco.MjData, chain: Chain) -> Array:
    """Step to the end and return (n_sample, n_sensordata).

    A step evaluates forces and sensors, then moves on: after 1 step the sensors show the start, after 1 + k steps
    the k-th. Between records the sensors are switched off.
    """
    rows = np.empty((n_records(chain), model.nsensordata))
    off = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    for n in range(len(rows)):
        if n and chain.steps_per_record > 1:
            model.opt.disableflags |= off
            mujoco.mj_step(model, data, nstep=chain.steps_per_record - 1)
            model.opt.disableflags &= ~off
        mujoco.mj_step(model, data)
        rows[n] = data.sensordata
        if data.userdata[Head.TIME] < 0.0:
            raise EngineError("the device law was not called: something replaced MuJoCo's passive callback")
        if data.userdata[Head.OVER] or not np.isfinite(data.userdata[Head.IMPULSE]):
            return rows[: n + 1]
    return rows
