"""Cases that are measured at once: each of them has the numbers and the words that it has alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import KINDS_OF_DEVICE, built, chain, envelope

from trainmj.collision import kernel
from trainmj.collision.block import Layout, Tally
from trainmj.collision.chain import Chain
from trainmj.collision.channels import channels_of
from trainmj.collision.elementwise import added, total
from trainmj.collision.envelope import Array
from trainmj.collision.fields import Head, Joint
from trainmj.collision.found import Found
from trainmj.collision.lineup import line_up
from trainmj.collision.lot import Chains
from trainmj.collision.measured import Measured
from trainmj.collision.model import build, split_sensors
from trainmj.collision.quantities import VEHICLE, columns_of
from trainmj.collision.simulation import _log, start
from trainmj.collision.stability import largest_step
from trainmj.collision.summary import Summary, measure
from trainmj.scenario import load

EVERY_KIND = str(Path(__file__).with_name("every_kind.yaml"))


@dataclass(frozen=True)
class Run:
    """A collision and what its simulation has left."""

    chain: Chain
    layout: Layout
    block: Array
    velocity: Array

    @property
    def alone(self) -> Summary:
        """Measured by itself."""
        n = len(self.velocity)
        return measure(self.chain, Tally.of(self.layout, self.block), self.chain.record_times(n), self.velocity)


def ran(case: Chain) -> Run:
    layout = Layout.of(case)
    model = build(case, layout)
    with kernel.installed():
        data = start(model, case, layout)
        logged = _log(model, data, case)
    return Run(case, layout, data.userdata.copy(), split_sensors(case, logged)["velocity"])


def together(runs: list[Run]) -> Measured:
    """As the cases of one lot."""
    lot = Chains(range(len(runs)), [run.chain for run in runs])
    blocks = np.array([run.block for run in runs])
    return Measured.of(lot, runs[0].layout, blocks, [run.velocity for run in runs])


B_TYPE = {
    "simulation.time_limit_s": 0.6,
    "simulation.averaging_ms": 4,
    "occupants.free_flight_mm": [300, 760],
    "limits.TS_mm": 4000,
    "limits.stroke_mm": 900,
}
BODY = {"stiffness_kN_per_mm": 400, "members": 4, "damping_ratio": 0.02, "collapse_force_kN": 1600}
LOTS: dict[str, tuple[str, dict[str, Any], list[dict[str, Any]], set[str]]] = {
    "b_type": (
        "b_type",
        B_TYPE,
        [
            {"collision.speed_km_h": 9},
            {"mass_t": 36},
            {"collision.speed_km_h": 15, "limits.TS_mm": 10},
            {"collision.speed_km_h": 40},
            {"collision.gap_mm": 60_000},
            {"collision.speed_km_h": 20, "empty_stroke_mm": 35},
        ],
        {"over", "time limit", "limit passed", "stroke exhausted", "no contact"},
    ),
    "as_built": (
        "b_type",
        {"as_built": {"M1": {"mass_t": 34}, "M2-M3": {"stroke_limit_mm": 400}}, "simulation.time_limit_s": 0.4},
        [{"as_built.M1.mass_t": 30}, {"as_built.M2-M3.stroke_limit_mm": 20}],
        {"time limit", "stroke exhausted"},
    ),
    "wagon": ("wagon_80t", {}, [{"collision.speed_km_h": v} for v in (5, 25)], {"over"}),
    "every_kind": (
        EVERY_KIND,
        {"simulation.time_limit_s": 0.5},
        [
            {"collision.speed_km_h": 3},
            {"collision.speed_km_h": 14, "limits.mean_deceleration_g": 0.1},
            {"collision.speed_km_h": 40},
        ],
        {"time limit", "limit passed", "stroke exhausted"},
    ),
    "lorry": (
        EVERY_KIND,
        {"collision.partner": "lorry", "simulation.time_limit_s": 0.5},
        [{"collision.speed_km_h": v} for v in (5, 60)],
        {"time limit", "curve ended"},
    ),
    "bodies": (
        "b_type_wall",
        {"trains.b_type.body": BODY},
        [{"collision.speed_km_h": 6}, {"trains.b_type.body.collapse_force_kN": 900}],
        {"over", "stroke exhausted"},
    ),
    "plane": (
        "b_type_vertical",
        {"simulation.time_limit_s": 0.4, "limits.met_step_mm": 100},
        [{"collision.speed_km_h": 9}, {"collision.offset_mm": {"M": 150}}],
        {"limit passed", "override"},
    ),
}


@pytest.fixture(scope="module")
def lots() -> dict[str, list[Run]]:
    """The cases of each lot."""
    found = {}
    for name, (scenario, changes, cases, _) in LOTS.items():
        base = load(scenario, changes)
        found[name] = [ran(line_up(base.with_values(case))) for case in cases]
    e = envelope([(0, 0), (50, 50_000)], 1000)
    meeting, leaving = (chain([1e3] * 3, [e, e], speeds) for speeds in ([3.0, 0.0, 0.0], [0.0, 0.0, 3.0]))
    step = 5.0 * largest_step(meeting)
    found["unstable"] = [
        ran(replace(case, step=step, steps_per_record=1, time_limit=0.2)) for case in (meeting, leaving)
    ]
    return found


NAMES = [*LOTS, "unstable"]


@pytest.mark.parametrize("name", NAMES)
def test_each_case_of_a_lot_has_the_bits_and_words_that_it_has_alone(lots, name):
    """Breaks if a case takes a number of another one, or a sum runs in another order where there are many."""
    runs = lots[name]
    found = Found(together(runs))
    assert list(found.columns) == list(columns_of(runs[0].chain))
    for k, run in enumerate(runs):
        alone = run.alone
        assert found.numbers[k].tobytes() == np.array(list(alone.responses.values())).tobytes()
        assert (found.kinds[k], found.reasons[k]) == (alone.status.kind.value, alone.status.reason)
        assert repr([one.of(k) for one in found.limits]) == repr(list(alone.limits))
        judged = [(bool(one.kept[k]), float(one.used[k])) for one in found.limits]
        assert repr(judged) == repr([(one.kept, one.used) for one in alone.limits])
        assert bool(found.over[k]) == alone.over
        summary = found.summary(k)
        assert repr(summary.as_dict()) == repr(alone.as_dict())
        assert (summary.remarks, summary.not_valid) == (alone.remarks, alone.not_valid)


@pytest.mark.parametrize("name", NAMES)
def test_those_cases_end_in_many_ways(lots, name):
    """Guards the test above: every kind of end is there, beside others."""
    wanted = LOTS[name][3] if name in LOTS else {"unstable", "no contact"}
    assert set(Found(together(lots[name])).kinds) == wanted


def test_cases_are_taken_from_a_lot_in_any_order(lots):
    runs = lots["b_type"]
    measured = together(runs)
    some = np.array([3, 0, 4])
    assert Found(measured.take(some)).numbers.tobytes() == Found(measured).numbers[some].tobytes()
    assert Found(measured.take(some)).keys == [3, 0, 4]


def test_a_jump_is_seen_in_the_case_that_made_it(lots):
    measured = together(lots["unstable"])
    assert measured.jumped.tolist() == [together([run]).jumped.item() for run in lots["unstable"]]
    assert measured.jumped.tolist()[0]
    peaks = lots["wagon"]
    unseen = [replace(run, block=run.block.copy()) for run in peaks]
    layout = unseen[1].layout
    layout.joint(unseen[1].block, Joint.UNSEEN_FORCE)[:] = 1e9
    assert together(unseen).jumped.tolist() == [False, True]


@pytest.mark.filterwarnings("error")
def test_a_value_that_is_not_finite_stays_in_its_case(lots):
    runs = list(lots["b_type"])
    runs[1] = replace(runs[1], block=np.where(np.arange(len(runs[1].block)) > len(Head), np.nan, runs[1].block))
    runs[1].block[: len(Head)] = lots["b_type"][1].block[: len(Head)]
    before, found = Found(together(lots["b_type"])), Found(together(runs))
    assert found.reasons[1] == "a value is not finite; take a smaller step"
    others = np.arange(len(runs)) != 1
    assert found.numbers[others].tobytes() == before.numbers[others].tobytes()
    assert [found.kinds[k] for k in np.flatnonzero(others)] == [before.kinds[k] for k in np.flatnonzero(others)]


def test_channels_of_a_lot_are_those_of_each_case(lots):
    names = list(channels_of(lots["b_type"][0].chain))[:14]
    for run, channels in zip(lots["b_type"], Found(together(lots["b_type"])).channels(names), strict=True):
        (alone,) = Found(together([run])).channels(names)
        assert list(channels) == names
        for name, trace in channels.items():
            assert trace.packed() == alone[name].packed()


def test_what_is_not_wanted_is_not_computed(lots, monkeypatch):
    """Breaks if a sweep of TS alone filters the speeds of every vehicle."""
    runs = lots["b_type"]

    def never(_: Measured) -> Array:
        raise AssertionError("nobody asked for it")

    for quantity in VEHICLE:
        if quantity.key not in ("mean_deceleration", "peak_device_acceleration"):  # limits of the scenario
            monkeypatch.setitem(vars(quantity), "value", never)
    found = Found(together(runs), ["TAMA_g", "TS_mm", "stroke_S1_M1_anti_climber_mm"])
    assert list(found.columns) == ["TS_mm", "TAMA_g", "stroke_S1_M1_anti_climber_mm"], "in the order of tables"
    numbers, kinds = found.numbers, found.kinds
    with pytest.raises(AssertionError, match="nobody asked"):
        Found(together(runs)).numbers  # noqa: B018
    monkeypatch.undo()
    whole = Found(together(runs))
    assert kinds == whole.kinds
    places = [list(whole.columns).index(name) for name in found.columns]
    assert numbers.tobytes() == whole.numbers[:, places].tobytes()


# element by element


@pytest.mark.parametrize("name", KINDS_OF_DEVICE)
def test_many_laws_hold_and_keep_what_each_does(name):
    """Breaks if a law takes the numbers, the curve or the states of its neighbour."""
    law = built()[name].law
    rng = np.random.default_rng(5)
    shape = (7, 3)
    stroke, force = rng.uniform(-0.01, 0.2, shape), rng.choice([0.0, 1.0], shape) * rng.uniform(0, 2e6, shape)
    state, given = rng.uniform(0.0, 0.1, shape), rng.uniform(0.0, 0.02, shape)

    class Many:
        parameters = tuple(np.full(shape, value) for value in law.parameters)
        curves = tuple(np.broadcast_to(c[:, None, None], (3, *shape, c.shape[1])) for c in law.curves)

    stored = law.kind.stored(Many(), stroke, force, state, given)
    kept = law.kind.permanent(Many(), state, given)
    for place in np.ndindex(shape):
        values = [float(of[place]) for of in (stroke, force, state, given)]
        assert stored[place] == law.kind.stored(law, *values)
        assert np.broadcast_to(kept, shape)[place] == law.kind.permanent(law, *values[2:])
    assert np.ptp(stored) > 0.0, "otherwise nothing is compared"


def test_sums_of_many_have_the_bits_of_each():
    values = np.random.default_rng(3).standard_normal((50, 23)) * 10.0 ** np.arange(-11, 12)
    for n in (0, 1, 2, 3, 9, 23):
        of_all = values[:, :n]
        assert total(of_all).tolist() == [float(np.sum(row.copy())) for row in of_all]
        assert added(of_all).tolist() == [float(sum(row.tolist())) for row in of_all]
        parted = values[:48, :n].reshape(4, 12, n)
        assert added(parted).ravel().tolist() == added(of_all)[:48].tolist()
