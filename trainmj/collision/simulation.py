"""One collision, headless: build the model, step it until the collision is over, keep what its sensors say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from trainmj.collision import kernel
from trainmj.collision.block import Layout, Tally
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.fields import Head
from trainmj.collision.identity import identity
from trainmj.collision.lineup import line_up
from trainmj.collision.measured import Measured
from trainmj.collision.mj import mujoco
from trainmj.collision.model import build, split_sensors
from trainmj.collision.result import Result
from trainmj.errors import EngineError
from trainmj.scenario import Scenario, scenario_given

LAW_NOT_CALLED = "the device law was not called: something replaced MuJoCo's passive callback"


def run(scenario: Scenario | str | Path, changes: Mapping[str, Any] | None = None, **parameters: Any) -> Result:
    """Compute one collision: ``run("b_type")``, ``run("b_type", speed_km_h=20)``.

    The run ends when no device carries force and none comes closer, or all vehicles stand, and bodies that give have
    swung on for a while; or at the time limit. Where a step has passed a peak of a curve unseen, it is computed again
    with smaller steps there.

    Args:
        scenario: what to collide: a scenario, the path of its file, or the name of one that ships.
        changes: values to change, by path or parameter, as in :meth:`trainmj.Scenario.with_values`.
        parameters: the same, as keywords.

    Returns:
        Histories at the recorded times and the tally of every step.

    Raises:
        InputError: if the file or a change breaks a rule, or the step is too large for the stiffest device and the
            lightest vehicle.
        TypeError: if it is something else.
        EngineError: if the running MuJoCo cannot carry the device law, or something replaced it.
    """
    scenario = scenario_given(scenario, changes, parameters)
    chain = line_up(scenario)
    result = _run(scenario, chain)
    measured = Measured.of_one(chain, result.tally, result.time, result.velocity)
    if measured.jumped.any():
        result = _run(scenario, replace(chain, refined=True))
    return result


def _run(scenario: Scenario, chain: Chain) -> Result:
    """Compute the collision of a chain."""
    layout = Layout.of(chain)
    with kernel.installed():
        model = build(chain, layout)
        data = start(model, chain, layout)
        logged = _log(model, data, chain)
    return Result(
        scenario,
        chain,
        Tally.of(layout, data.userdata),
        time=chain.record_times(len(logged)),
        **split_sensors(chain, logged),
        versions=identity(),
    )


def start(model: mujoco.MjModel, chain: Chain, layout: Layout) -> mujoco.MjData:
    """A simulation at the start: speeds set, devices unused."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.userdata[:] = layout.block(chain)
    return data


def _log(model: mujoco.MjModel, data: mujoco.MjData, chain: Chain) -> Array:
    """Step to the end and return (n_sample, n_sensordata).

    A step evaluates forces and sensors, then moves on: after 1 step the sensors show the start, after 1 + k steps
    the k-th. Between records the sensors are switched off.
    """
    rows = np.empty((chain.n_records, model.nsensordata))
    off = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    for n in range(len(rows)):
        model.opt.disableflags |= off
        while (left := _before(n, data, chain)) > 0:
            made = data.userdata[Head.STEPS]
            mujoco.mj_step(model, data, nstep=left)
            if data.userdata[Head.STEPS] == made:
                raise EngineError(LAW_NOT_CALLED)
        model.opt.disableflags &= ~off
        mujoco.mj_step(model, data)
        rows[n] = data.sensordata
        if data.userdata[Head.TIME] < 0.0:
            raise EngineError(LAW_NOT_CALLED)
        if data.userdata[Head.OVER] or not np.isfinite(data.userdata[Head.IMPULSE]):
            return rows[: n + 1]
    return rows


def _before(n: int, data: mujoco.MjData, chain: Chain) -> int:
    """Steps, at least, before the one that shows record n; none if it is the next one."""
    block = data.userdata
    return n * chain.steps_per_record - int(block[Head.GRID]) + int(block[Head.PARTS_LEFT])
