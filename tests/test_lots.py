"""Cases in lots: whatever changes, each has the bits that its own chain has, and is refused in the same words."""

from __future__ import annotations

import logging
import math
import operator
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import few

import trainmj
from trainmj.collision import lots, played
from trainmj.collision.block import Layout
from trainmj.collision.cases import Cases
from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Envelope
from trainmj.collision.lineup import line_up
from trainmj.collision.lots import Lots, Refused
from trainmj.collision.model import numbers_of
from trainmj.collision.played import Program
from trainmj.errors import InputError
from trainmj.scenario import Scenario
from trainmj.scenario.scenario import without_words
from trainmj.symbol import Symbol, Tape, TraceError, case_by_case, largest, least, square_root

EVERY_KIND = Path(__file__).with_name("every_kind.yaml")
BUILT = {
    "M1": {"mass_t": 30.0, "rail_friction": 0.01},
    "M1-M2": {"curve": {"stroke_mm": [0.0, 10.0, 500.0], "force_kN": [0.0, 800.0, 900.0]}},
    "S1-M1": {"stages.anti_climber.empty_stroke_mm": 25.0, "beyond.collapse_force_kN": 2100.0},
}
BODIES = {
    "stated": {"stiffness_kN_per_mm": 1000.0},
    "section": {"EA_MN": 2000.0, "members": 3, "collapse_force_kN": 5000.0, "attached_m": [1.0, 1.5]},
    "bogies": {"frequency_Hz": 12.0, "hardening_kN_per_mm": 5.0, "collapse_force_kN": 6000.0}
    | {"bogies": {"mass_t": 4.0, "centres_m": 12.0}},
}


@pytest.fixture(autouse=True)
def _few(monkeypatch):
    """Few cases are enough for a trace here."""
    monkeypatch.setattr(lots, "_WORTH", 5)


def numbers(chain: Chain, layout: Layout) -> np.ndarray:
    """All with which a simulation begins."""
    model = [np.ravel(values) for values in numbers_of(chain).values()]
    return np.concatenate([layout.block(chain), chain.start_qpos, chain.start_qvel, *model])


def check(scenario: Scenario, cases: Cases) -> Counter[str]:
    """Compare cases in lots with each alone, and count what they came in."""
    alone: dict[Any, Chain | str] = {}
    for key, changes in zip(cases.keys, cases, strict=True):
        try:
            alone[key] = line_up(scenario.with_values(changes))
        except InputError as error:
            alone[key] = str(error)
    kinds: Counter[str] = Counter()
    place = {key: n for n, key in enumerate(cases.keys)}
    left = set(cases.keys)
    for lot in Lots(scenario)([cases]):
        if isinstance(lot, Refused):
            kinds["refused"] += 1
            assert alone[lot.key] == lot.reason
            left.remove(lot.key)
            continue
        kinds[type(lot).__name__.lower()] += len(lot)
        assert [place[key] for key in lot.keys] == sorted(place[key] for key in lot.keys)
        layout = Layout.of(lot.chain, 0, 3)
        found = np.concatenate(
            [
                lot.blocks(layout),
                lot.values(lambda chain: chain.start_qpos),
                lot.values(lambda chain: chain.start_qvel),
                lot.values(lambda chain: np.concatenate([np.ravel(v) for v in numbers_of(chain).values()])),
            ],
            axis=1,
        )
        for key, row in zip(lot.keys, found, strict=True):
            left.remove(key)
            assert row.tobytes() == numbers(alone[key], layout).tobytes(), key
    assert not left
    return kinds


def leaves(values: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], float]]:
    """The numbers of a scenario, with their paths."""
    if isinstance(values, dict):
        for key, inner in values.items():
            yield from leaves(inner, (*path, key))
    elif isinstance(values, list):
        for n, inner in enumerate(values):
            yield from leaves(inner, (*path, n))
    elif isinstance(values, int | float) and not isinstance(values, bool):
        yield path, values


def numeric(scenario: Scenario) -> list[tuple[str, float]]:
    """What of a scenario may vary, by path."""
    values = without_words(scenario.values())
    left_out = {"parameters", "tolerances", "occupants", "simulation", "as_built"}
    return [(".".join(map(str, path)), value) for path, value in leaves(values) if path[0] not in left_out]


def around(rng: np.random.Generator, value: float, n: int, part: float = 0.02) -> list[float]:
    """Numbers around a value, or above 0."""
    drawn = rng.standard_normal(n)
    return (value * (1.0 + part * drawn) if value else abs(drawn)).tolist()


def scatters(scenario: Scenario, path: str, value: float) -> bool:
    """Whether a number may be a little smaller and larger."""
    try:
        return all(scenario.with_values({path: factor * value}) is not None for factor in (0.99, 1.01))
    except InputError:
        return False


def scenario_of(name: str) -> Scenario:
    """A scenario by a short name."""
    if name in BODIES:
        return trainmj.load("b_type").with_values(
            {"trains.b_type.body": BODIES[name], "simulation.step_ms": 0.02, "trains.b_type.length_m": 21.0}
        )
    if name == "built":
        return trainmj.load("b_type", as_built=BUILT)
    return trainmj.load(EVERY_KIND if name == "every_kind" else name)


ALONG = ("b_type", "b_type_wall", "wagon_80t", "fra_cem_train", "every_kind", "built", *BODIES)


@pytest.mark.parametrize("name", few(ALONG, 3))
def test_numbers_of_cases_in_lots_are_those_of_each_alone(name):
    """Of as many values at once as a study or a reliability run varies."""
    scenario, rng = scenario_of(name), np.random.default_rng(5)
    stated = [(path, value) for path, value in numeric(scenario) if scatters(scenario, path, value)]
    kinds: Counter[str] = Counter()
    for _ in range(6):
        chosen = rng.choice(len(stated), size=4, replace=False)
        values = [around(rng, stated[n][1], 10, 0.002) for n in chosen]
        kinds += check(scenario, Cases(range(10), [(stated[n][0],) for n in chosen], values))
    assert kinds["traced"] > kinds["chains"], kinds


@pytest.mark.thorough
@pytest.mark.parametrize("name", [*ALONG, "b_type_scenario_1", "en15227_c1", "fra_cem_two", "b_type_two_formations"])
def test_each_number_of_a_scenario_may_vary(name, caplog):
    """Whatever number it is: nearly all go together, and never is a number another one."""
    scenario, rng = scenario_of(name), np.random.default_rng(6)
    kinds: Counter[str] = Counter()
    for path, value in numeric(scenario):
        kinds += check(scenario, Cases(range(8), [(path,)], [around(rng, value, 8)]))
    assert kinds["traced"] > 10 * kinds["chains"], kinds
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["b_type_vertical", "emu_vertical"])
def test_in_the_vertical_plane_numbers_are_those_of_each_alone(name):
    scenario, rng = scenario_of(name), np.random.default_rng(7)
    stated = numeric(scenario)
    for n in rng.choice(len(stated), size=12, replace=False):
        check(scenario, Cases(range(7), [(stated[n][0],)], [around(rng, stated[n][1], 7, 0.01)]))


def test_single_vehicles_and_devices_vary_as_built():
    """Beside what is stated of their kind: a single device takes over what it does not state itself."""
    rng, n = np.random.default_rng(8), 12
    varied = {
        ("as_built", "M1", "mass_t"): 30.0,
        ("as_built", "M1", "rail_friction"): 0.01,
        ("as_built", "M1-M2", "curve", "stroke_mm", 0): 0.0,
        ("as_built", "M1-M2", "curve", "stroke_mm", 1): 10.0,
        ("as_built", "M1-M2", "curve", "stroke_mm", 2): 500.0,
        ("as_built", "M1-M2", "curve", "force_kN", 0): 0.0,
        ("as_built", "M1-M2", "curve", "force_kN", 1): 800.0,
        ("as_built", "M1-M2", "curve", "force_kN", 2): 900.0,
        ("as_built", "S1-M1", "stages.anti_climber.empty_stroke_mm"): 25.0,
        ("devices.front.stiffness_kN_per_mm",): 1000.0,
        ("devices.coupler_a_b.damping_kN_s_per_m",): 27500.0,
        ("mass_t",): 33.0,
    }
    columns = [np.array(around(rng, value, n, 0.01)) if value else np.zeros(n) for value in varied.values()]
    assert check(trainmj.load("b_type"), Cases(range(n), list(varied), columns)) == {"traced": n}


@pytest.mark.parametrize(
    ("name", "values"),
    [
        # an empty stroke that is none, and one shorter than the shear-off before it needs
        ("empty_stroke_mm", [22.0, 30.0, 0.528, 0.5, 0.0, 40.0, 25.0, 26.0, 27.0, 28.0]),
        # bolts that fail below the force at which their curve ends, or right at it
        ("devices.front.stages.coupler.shear_off.force_kN", [1200.0, 1000.0, 999.0, 1100.0, 0.0, 1e9, 1e3, 1250.0]),
        # a curve that no longer reaches as far as the next part begins
        ("curves.buffer.stroke_mm.8", [73.0, 73.2, 73.223, 73.3, 54.0, 60.0, 72.0, 70.0, 73.22, -1.0]),
        ("collision.rail_friction", [0.008, 0.0, 0.0, 0.1, 1.0, 1.1, -0.0, 0.3, 0.2]),
        ("collision.gap_mm", [0.0, 10.0, -0.0, 5.0, -5.0, 1e6, 1e7, 3.0]),
        ("collision.grade_per_mille", [0.0, 1.0, -1.0, 0.0, 200.0, 201.0, 7.0, 3.0]),
        ("mass_t", [33.0, 20.0, 29.99, 30.0, 1e-3, 200.0, 201.0, 33, 0, 2.0, 1.0]),  # below 30 t it counts as a model
        ("speed_km_h", [25.0, 25, 0.1, 0.09, 0.0, -3.0, 200.0, 2 * 10**30, 24.0]),
        ("devices.front.beyond.collapse_force_kN", [2000.0, 1250.0, 1249.9, 1999.0, 5e4, 1e5, 1500.0, 1600.0]),
        ("devices.coupler_a_b.damping_kN_s_per_m", [27500.0, 0.0, 5.0, 1e5, 0.0, 27000.0, 26000.0, 1.0]),
        ("devices.coupler_a_b.stiffness_kN_per_mm", [3000.0, 2.0, 31.34, 1.0, 5e4, 25.42, 100.0, 3001.0]),
        ("devices.coupler_a_b.stroke_limit_mm", [418.0, None, 419.0, 800.0, 801.0, 1.0, 2.0, 3.0, 4.0]),
        # what a function that is asked case by case raises
        ("devices.gas.gas.length_mm", [120.0, 110.0, 105.0, 104.0, 50.0, 0.0, -1.0, 121.0, 125.0]),
        ("devices.gas.gas.exponent", [1.3, 1.0, 3.0, 0.5, 4.0, 1.4, 1.2, 1.1]),
        ("devices.oil.preload_kN", [100.0, 0.0, 99.0, -1.0, 101.0, 5e4, 102.0]),
        ("devices.gear.unloading.force_kN.0", [50.0, 100.0, 100.1, 0.0, 60.0, 70.0, 80.0]),
        ("limits.mean_deceleration_g", [5.0, 6.0, 0.0, 7.0, 8.0, 9.0, 10.0]),
        ("mass_t", [33.0, "33", 34.0, True, math.nan, math.inf, 35.0, 36.0, 37.0, [33]]),
        ("simulation.step_ms", [0.1, 0.1, 0.25, 0.5, 0.6, 0.604, 1.0, 0.2]),  # up to and beyond the largest step
        ("trains.b_type.vehicles", [2, 3.0, 2, 3, 2, 2, 3, 2, 3, 2.5]),
        ("nosuch", [1.0, 2.0]),
        ("devices.front.nosuch", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]),
    ],
)
def test_cases_that_take_another_way_are_found(name, values):
    """Where a rule breaks or the structure changes, in whichever order the cases come."""
    scenario = trainmj.load(EVERY_KIND if name.startswith(("devices.gas", "devices.oil", "devices.gear")) else "b_type")
    scenario = scenario.with_values({"parameters.mass_t": "trains.t.mass_t"}) if "t" in scenario.trains else scenario
    check(scenario, Cases(range(len(values)), [(name,)], [values]))
    others = [30.0 + 0.1 * n for n in range(len(values))]
    more = {} if name == "mass_t" else {("mass_t",): others}
    check(scenario, Cases(range(len(values)), [(name,), *more], [values[::-1], *more.values()]))


def test_the_step_is_compared_with_the_largest_of_each_case():
    """Below the largest step, and beyond it."""
    scenario = trainmj.load("b_type").with_values({"simulation.step_ms": 0.57, "simulation.record_every_ms": 1.14})
    masses = np.linspace(25.01, 35.01, 81)  # none that the scenario states itself, which would go another way
    found = check(scenario, Cases(range(81), [("mass_t",)], [masses]))
    assert 0 < found["refused"] < 80
    assert found["traced"] == 81 - found["refused"]


def test_values_that_are_no_numbers_are_grouped():
    scenario = trainmj.load("b_type")
    names = [("collision.partner",), ("trains.b_type.drawing",), ("mass_t",), ("simulation.time_limit_s",)]
    n = 64
    columns = [
        [("b_type", "rigid_wall")[k % 2] for k in range(n)],
        ["passenger"] * n,
        [30.0 + 0.01 * k for k in range(n)],
        [(2.0, 3.0)[k // 2 % 2] for k in range(n)],
    ]
    assert check(scenario, Cases(range(n), names, columns)) == {"traced": n}
    found = [lot for lot in Lots(scenario)([Cases(range(n), names, columns)]) if not isinstance(lot, Refused)]
    assert sorted(len(lot) for lot in found) == [16, 16, 16, 16]
    structures = {(len(lot.chain.vehicles), lot.chain.time_limit) for lot in found}
    assert structures == {(6, 2.0), (6, 3.0), (12, 2.0), (12, 3.0)}


# symbols


@pytest.mark.parametrize(
    "lose",
    [
        float,
        int,
        str,
        hash,
        complex,
        math.floor,
        math.sqrt,
        math.isfinite,
        operator.index,
        "{:g}".format,
        lambda symbol: f"{symbol}",
        lambda symbol: np.array([symbol], dtype=np.float64),
        lambda symbol: np.float64(symbol),
        lambda symbol: np.zeros(3).__setitem__(0, symbol),
        lambda symbol: np.zeros(3).fill(symbol),
        lambda symbol: np.sin(symbol),
        lambda symbol: np.isfinite(symbol),
        lambda symbol: {symbol},
        lambda symbol: [1, 2][symbol],
        lambda symbol: round(symbol, 2),
        lambda symbol: symbol // 2,
        lambda symbol: range(symbol),
    ],
)
def test_a_symbol_becomes_no_number(lose):
    with pytest.raises(TypeError):
        lose(Tape().symbol(2.0))


def test_a_symbol_stays_one():
    tape = Tape()
    x = tape.symbol(2.0)
    for found in (x + 1, 1 + x, np.float64(1.0) + x, x - np.float64(1.0), abs(-x), x**0.5, 2**x, np.int64(3) * x):
        assert type(found) is Symbol
    arrays = np.array([x, 1.0]) * 3.0, np.arange(2.0) / x, np.where([True, False], x, 0.0), np.append([1.0], x)
    for array in arrays:
        assert array.dtype == object
        assert any(type(value) is Symbol for value in array)


def played_back(tape: Tape, found: Sequence[Any], columns: Sequence[Sequence[float]]) -> tuple[np.ndarray, np.ndarray]:
    """What symbols are in several cases, and which of these take their way."""
    out = Program.of(tape).play(np.array(columns, dtype=float))
    return out.rows([symbol.place for symbol in found]), out.kept


def powers(a: float, b: float) -> np.ndarray:
    return np.array([[a**b, a + b]])


def test_what_is_played_has_the_bits_of_plain_numbers():
    """Of every operation, for numbers of all sizes."""
    rng, n = np.random.default_rng(0), 2000
    a, b = np.exp(rng.normal(0.0, 8.0, n)), np.exp(rng.normal(0.0, 1.0, n)) + 1.0

    def work(x: Any, y: Any) -> list[Any]:
        found = [x + y, x - y, x * y, x / y, -x, abs(y - x), x**0.3, x**2, y**-y, 1.5**y, 1 / x, 3 - y]
        found += [square_root(x), largest([x, y, 7.0]), least([x, y]), (x + 0.1) * 3.3 / y]
        return found + list(np.ravel(case_by_case(powers, y, 0.7)))

    tape = Tape()
    symbols = work(tape.symbol(a[0]), tape.symbol(b[0]))
    rows, kept = played_back(tape, symbols, [a, b])
    assert kept.all()
    plain = np.array([work(*pair) for pair in zip(a.tolist(), b.tolist(), strict=True)]).T
    assert rows.tobytes() == np.ascontiguousarray(plain).tobytes()


def test_guards_tell_who_takes_another_way():
    tape = Tape()
    x = tape.symbol(2.0)
    y = 10.0 * x if x > 1.0 and x != 5.0 else x
    y = y + round(x)
    _, kept = played_back(tape, [y], [[2.0, 1.0, 5.0, 2.4, 2.6, math.nan, 2.5]])
    assert kept.tolist() == [True, False, False, True, False, False, True]


def test_what_plain_numbers_refuse_is_guarded():
    """Quotients by 0, roots and powers of what is below 0, and functions that raise or answer otherwise."""
    columns = [[2.0, 0.0, -1.0, 3.0]]
    for work in (
        lambda x: 1.0 / x + square_root(x),
        lambda x: 1.0 / x + x**0.5,
        lambda x: case_by_case(lambda a: np.array([math.log(a), a]), x)[0],
        lambda x: case_by_case(lambda a: np.zeros(2 if a > 0.0 else 3), x)[1],
    ):
        tape = Tape()
        _, kept = played_back(tape, [work(tape.symbol(2.0))], columns)
        assert kept.tolist() == [True, False, False, True]


def test_a_zero_keeps_its_sign():
    tape = Tape()
    x = tape.symbol(2.0)
    rows, _ = played_back(tape, [x * 0.0, x * -0.0], [[1.0]])
    assert np.signbit(rows[:, 0]).tolist() == [False, True]


def test_symbols_of_two_tapes_do_not_mix():
    with pytest.raises(TraceError):
        Tape().symbol(1.0) + Tape().symbol(2.0)


def test_envelopes_of_symbols_are_those_of_numbers():
    """Their climb, work and forces, for other numbers than those that were traced."""

    def work(steep: Any, height: Any) -> list[Any]:
        envelope = Envelope(np.array([0.0, 0.01, 0.1]), np.array([height, 2.0 * height, 3.0 * height]), steep, 0.0, 5.0)
        climbing = envelope.climbing
        points = [*climbing.stroke, *climbing.force, *climbing.slope]
        return [point for point in [*points, envelope.energy(0.05), climbing.force_at(0.02)] if point]

    tape = Tape()
    symbols = work(tape.symbol(1e8), tape.symbol(1e5))
    columns = [[1e8, 1.1e8, 1e7], [1e5, 0.9e5, 1e5]]
    at = [n for n, value in enumerate(symbols) if type(value) is Symbol]
    rows, kept = played_back(tape, [symbols[n] for n in at], columns)
    assert kept.tolist() == [True, True, False]  # the last one reaches its curve later
    for n in (0, 1):
        plain = work(columns[0][n], columns[1][n])
        assert rows[:, n].tolist() == [plain[k] for k in at]


# lots


def some_cases(n: int = 40) -> tuple[Scenario, Cases]:
    rng = np.random.default_rng(3)
    columns = [np.array(around(rng, 33.0, n)), np.array(around(rng, 22.0, n))]
    return trainmj.load("b_type"), Cases(range(n), [("mass_t",), ("empty_stroke_mm",)], columns)


@pytest.mark.parametrize("wrong", [operator.mul, operator.truediv])
def test_a_fault_of_what_is_played_is_seen(wrong, monkeypatch, caplog):
    """Cases are computed alone then, and the log says so."""
    right = played._FUNCTIONS[wrong]
    monkeypatch.setitem(played._FUNCTIONS, wrong, lambda one, other: np.nextafter(right(one, other), np.inf))
    scenario, cases = some_cases()
    found = check(scenario, cases)
    assert found == {"chains": len(cases)}
    assert "computed for many cases at once" in caplog.text


def test_what_cannot_be_traced_is_asked_one_by_one():
    scenario, cases = some_cases()
    (lot,) = Lots(scenario)([cases])
    found = lot.values(lambda chain: float(chain.mass[0]))
    assert found.tolist() == [1e3 * mass for mass in cases.values[0]]
    sums = lot.values(lambda chain: chain.mass.sum())  # in another order of the additions
    assert sums.tolist() == [line_up(scenario.with_values(changes)).mass.sum() for changes in cases]


def test_what_takes_another_way_where_it_is_asked_is_asked_alone():
    scenario, cases = some_cases()

    def of(chain: Chain) -> float:
        return chain.mass[0] if chain.mass[0] > 33e3 else -chain.mass[0]

    (lot,) = Lots(scenario)([cases])
    plain = [of(line_up(scenario.with_values(changes))) for changes in cases]
    assert lot.values(of).tolist() == plain


def test_some_of_a_lot_are_a_lot():
    scenario, cases = some_cases()
    (lot,) = Lots(scenario)([cases])
    layout = Layout.of(lot.chain)
    blocks = lot.blocks(layout)
    part = lot.take([5, 3, 30])
    assert part.keys == [5, 3, 30]
    assert part.blocks(layout).tobytes() == blocks[[5, 3, 30]].tobytes()
    assert part.values(lambda chain: chain.mass).tolist() == lot.values(lambda chain: chain.mass)[[5, 3, 30]].tolist()
    assert numbers(part.chain_of(1), layout).tobytes() == numbers(lot.chain_of(3), layout).tobytes()


def test_lots_have_their_size_and_all_cases():
    scenario, cases = some_cases(40)
    found = list(Lots(scenario, size=16)(iter([cases, cases.take(range(7)), cases.take([0])])))
    assert [len(lot) for lot in found] == [16, 16, 8, 7, 1]
    assert [key for lot in found for key in lot.keys] == [*range(40), *range(7), 0]


def test_what_a_source_says_belongs_to_the_structure():
    """A limit that is changed is marked as such; one that is restated as it was is not."""
    scenario = trainmj.load("b_type")
    limits = [5.0, 6.0, 5.0, 7.0, 8.0, 9.0, 10.0, 11.0, 5.0, 5.0, 5.0, 5.0, 5.0]
    found = list(Lots(scenario)([Cases(range(len(limits)), [("limits.mean_deceleration_g",)], [limits])]))
    told = {key: lot.chain.sources["limits.mean_deceleration_g"] for lot in found for key in lot.keys}
    for key, limit in enumerate(limits):
        alone = line_up(scenario.with_values({"limits.mean_deceleration_g": limit}))
        assert told[key] == alone.sources["limits.mean_deceleration_g"]
    assert len(set(told.values())) == 2


def test_what_was_traced_serves_the_next_cases():
    """As in a search that asks for a few cases at a time."""
    scenario, cases = some_cases()
    made = Lots(scenario)
    kinds = [type(lot).__name__ for n in range(0, 40, 2) for lot in made([cases.take([n, n + 1])])]
    assert kinds == ["Chains"] * 2 + ["Traced"] * 18


def test_groups_and_lists_of_numbers_are_traced():
    """A curve of each case, and parts as they are built: stated alike they go together, otherwise apart."""
    rng, n = np.random.default_rng(4), 12
    cases = []
    for _ in range(n):
        force = [0.0, *around(rng, 900.0, 2, 0.01)]
        built = {"M1": {"mass_t": around(rng, 33.0, 1)[0]}, "M1-M2": {"curve": {"stroke_mm": [0, 90, 800]}}}
        built["M1-M2"]["curve"]["force_kN"] = force
        cases.append(
            {"as_built": built, "curves.buffer.force_kN": [0, 127.1, 248.7, 376, 458.8, 548.7, 652.4, 773.5, 800]}
        )
    columns = [[case[name] for case in cases] for name in cases[0]]
    scenario, names = trainmj.load("b_type"), [(name,) for name in cases[0]]
    assert check(scenario, Cases(range(n), names, columns)) == {"traced": n}
    columns[0][3] = {"M1": {"mass_t": 30.0}}  # another group
    columns[1][4] = [0] * 8  # too short
    assert check(scenario, Cases(range(n), names, columns)) == {"chains": n - 1, "refused": 1}


def test_cases_that_change_nothing_are_a_lot():
    assert check(trainmj.load("wagon_80t"), Cases(range(7), [], [])) == {"traced": 7}
    assert not list(Lots(trainmj.load("wagon_80t"))([Cases([], [("mass_t",)], [[]])]))


@pytest.mark.parametrize("many", [False, True])
def test_free_flights_name_responses_and_so_belong_to_the_structure(many):
    """Breaks if cases get the names, or the numbers, of the flights of another one."""
    flights = [[200.0], [500.0]] * (8 if many else 1)
    cases = Cases(list(range(len(flights))), [("occupants.free_flight_mm",)], [flights])
    scenario = trainmj.load("b_type", {"simulation.step_ms": 0.5})
    for lot in Lots(scenario)([cases]):
        assert not isinstance(lot, Refused)
        stated = {tuple(flights[key]) for key in lot.keys}
        assert stated == {tuple(flight * 1e3 for flight in lot.chain.free_flights)}
