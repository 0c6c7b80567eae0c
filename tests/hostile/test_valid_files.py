"""Valid files of every kind: what is read, written and read again is the same, and it runs."""

from __future__ import annotations

import json
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from kinds import BASE, EVERY, KINDS, STUDY, SWEEP, TARGETS, Kind, command
from mutations import document, good, replaced

import trainmj
from trainmj import Standard
from trainmj.collision.block import Layout
from trainmj.collision.lineup import line_up
from trainmj.collision.repeated import repeated
from trainmj.errors import InputError
from trainmj.scenario import Scenario, from_yaml, to_yaml
from trainmj.study import Study
from trainmj.sweep import Sweep

number = st.floats  # always with bounds
words = st.text("abcäß列 [red]<b>&\"'`$%{}\\/:;,#|!?*=+-@~^_.", max_size=30)


@st.composite
def curves(draw: st.DrawFn, least: float = 0.001) -> dict[str, list[float]]:
    steps = draw(st.lists(number(least, 100), min_size=1, max_size=8))
    forces = draw(st.lists(number(0, 2000), min_size=len(steps) + 1, max_size=len(steps) + 1))
    stroke = [0.0]
    for step in steps:
        stroke.append(stroke[-1] + step)
    stroke[-1] += 5  # a device has more stroke
    return {"stroke_mm": stroke, "force_kN": [*forces[:-1], max(forces[-1], 5)]}


@st.composite
def rising(draw: st.DrawFn) -> dict[str, list[float]]:
    """A curve that never falls, so that another one may lie below it, and is not too steep for a transition."""
    curve = draw(curves(least=1.0))
    return curve | {"force_kN": sorted(curve["force_kN"])}


def steepest(curve: dict[str, list[float]]) -> float:
    points = list(zip(curve["stroke_mm"], curve["force_kN"], strict=True))
    return max((g - f) / (v - u) for (u, f), (v, g) in pairwise(points))


@st.composite
def beyond(draw: st.DrawFn, unstated: bool = True) -> dict[str, Any]:
    """What is behind a device, if anything is stated."""
    stiffness = draw(number(1, 500))
    body = {"kind": "car_body", "collapse_force_kN": draw(number(4000, 9000)), "stiffness_kN_per_mm": stiffness}
    stated = [body, {"kind": "stop", "stiffness_kN_per_mm": stiffness}, *(["hold", None] if unstated else [])]
    chosen = draw(st.sampled_from(stated))
    return {} if chosen is None else {"beyond": chosen}


@st.composite
def pulls(draw: st.DrawFn) -> dict[str, Any]:
    """Draw gear, or none."""
    pull: dict[str, Any] = {"stiffness_kN_per_mm": draw(number(1, 500)), "damping_kN_s_per_m": draw(number(0, 100))}
    if draw(st.booleans()):
        pull |= {"slack_mm": draw(number(0, 100)), "breaking_force_kN": draw(number(5, 1000))}
    if draw(st.booleans()):
        pull["curve"] = draw(rising())
    return draw(st.sampled_from([{}, {"pull": pull}]))


@st.composite
def crushed(draw: st.DrawFn) -> dict[str, Any]:
    device: dict[str, Any] = {
        "stiffness_kN_per_mm": draw(number(10, 5000)),
        "damping_kN_s_per_m": draw(number(0, 5000)),
    }
    first = draw(curves())
    if draw(st.booleans()):
        faster = {
            "speed_m_per_s": draw(number(0.1, 50)),
            "curve": first | {"force_kN": [*first["force_kN"][:-1], 2500]},
        }
        by_symonds = {"C_m_per_s": draw(number(0.001, 1e4)), "P": draw(number(0.5, 20))}
        rate = draw(st.sampled_from([{}, {"rate": by_symonds}, {"rate": {"curves": [faster]}}]))
        return device | rate | {"curve": first, "empty_stroke_mm": draw(number(0, 50))}
    shear = {"force_kN": first["force_kN"][-1] + draw(number(1, 500)), "ramp_mm": draw(number(0.01, 1))}
    second = {"curve": draw(st.sampled_from(["shared"]) | curves()), "empty_stroke_mm": draw(number(2, 60))}
    return device | {"stages": {"one": {"curve": first, "shear_off": shear}, "two": second}}


@st.composite
def gears(draw: st.DrawFn) -> dict[str, Any]:
    loading = draw(rising())
    share = draw(number(0, 1))
    unloading = loading | {"force_kN": [share * force for force in loading["force_kN"]]}
    return {
        "kind": "hysteresis",
        "loading": loading,
        "unloading": unloading,
        "transition_stiffness_kN_per_mm": steepest(loading) + draw(number(1, 500)),
        "empty_stroke_mm": draw(number(0, 50)),
    }


@st.composite
def buffers(draw: st.DrawFn) -> dict[str, Any]:
    stroke = draw(number(5, 500))
    device: dict[str, Any] = {"kind": "hydraulic", "stroke_mm": stroke, "empty_stroke_mm": draw(number(0, 50))}
    orifices = draw(st.lists(number(1, 500), min_size=2, max_size=2))
    device |= draw(
        st.sampled_from(
            [
                {"orifice_kN_s2_per_m2": orifices[0]},
                {"metering": {"stroke_mm": [0, stroke], "orifice_kN_s2_per_m2": orifices}},
            ]
        )
    )
    stiffness = draw(number(1, 500))
    if draw(st.booleans()):
        gas = {
            "force_kN": draw(number(1, 100)),
            "length_mm": stroke * draw(number(1.2, 5)),
            "exponent": draw(number(1, 1.6)),
            "preload_stiffness_kN_per_mm": stiffness,
        }
        return device | {"kind": "gas_hydraulic", "gas": gas, "rebound_orifice_kN_s2_per_m2": draw(number(0, 500))}
    return device | draw(
        st.sampled_from(
            [{}, {"preload_kN": min(50.0, 0.9 * stiffness * stroke), "preload_stiffness_kN_per_mm": stiffness}]
        )
    )


@st.composite
def devices(draw: st.DrawFn) -> dict[str, Any]:
    """A device of any kind."""
    kind = draw(st.sampled_from([crushed, gears, buffers]))
    return draw(kind()) | draw(beyond(unstated=kind is not buffers)) | draw(pulls())


@st.composite
def scenarios(draw: st.DrawFn) -> dict[str, Any]:
    """Values of scenario files that keep all rules but perhaps that of the step."""
    names = ["d1", "d2", "d3"]
    coupler = st.sampled_from(names) | st.lists(st.sampled_from(names), min_size=2, max_size=2)
    brakes = {"force_kN": draw(number(0, 100)), "delay_s": draw(number(0, 0.02)), "rise_s": draw(number(0, 0.02))}
    train = {
        "mass_t": draw(number(1, 200)),
        "length_m": draw(number(0.5, 60)),
        "coupler": draw(coupler),
        "front": draw(st.sampled_from(names)),
        "rear": draw(st.sampled_from(names)),
        "vehicles": draw(
            st.integers(1, 6)
            | st.lists(
                st.fixed_dictionaries(
                    {"name": st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.+/ -]{0,10}", fullmatch=True)},
                    optional={
                        "mass_t": number(1, 200),
                        "coupler": coupler,
                        "rail_friction": number(0, 1),
                        "brakes": st.just(brakes),
                    },
                ),
                min_size=1,
                max_size=5,
            )
        ),
        "drawing": draw(st.sampled_from(["passenger", "regional", "coach", "wagon", "locomotive"])),
    } | draw(st.sampled_from([{}, {"brakes": brakes}]))
    speed = draw(number(1, 200))
    partner = draw(st.sampled_from(["t", "rigid_wall", "lorry", "stop"]))
    fixed = partner in ("rigid_wall", "stop")
    return {
        "title": draw(words),
        "notes": draw(words),
        "curves": {"shared": draw(curves())},
        "devices": {name: draw(devices()) for name in names},
        "trains": {"t": train},
        "obstacles": {
            "lorry": {"mass_t": draw(number(0.5, 50)), "front": draw(st.sampled_from(names)), "rail_friction": 0.3},
            "stop": {"fixed": True, "front": draw(st.sampled_from(names))},
        },
        "collision": {
            "train": "t",
            "train_end": draw(st.sampled_from(["front", "rear"])),
            "speed_km_h": speed,
            "partner": partner,
            "partner_speed_km_h": 0 if fixed else draw(number(-200, speed - 0.5)),
            "partner_end": draw(st.sampled_from(["front", "rear"])) if partner == "t" else "front",
            "gap_mm": draw(number(0, 100)),
            "rail_friction": draw(number(0, 1)),
            "grade_per_mille": draw(number(-40, 40)),
        },
        "simulation": {"step_ms": 0.02, "record_every_ms": 1, "time_limit_s": 0.02},
    }


def shape(scenario: Scenario) -> str:
    """Everything that the law is told, or why its step is refused."""
    try:
        chain = line_up(scenario)
    except InputError as error:
        return str(error)
    return repr((chain.vehicles, [i.name for i in chain.interfaces], chain.gap, Layout.of(chain).block(chain).tolist()))


@pytest.mark.thorough
@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(scenarios())
def test_scenarios_written_and_read_again_are_the_same(values: dict[str, Any]) -> None:
    scenario = Scenario.from_values(values)
    again = from_yaml(to_yaml(scenario))
    assert again.values() == scenario.values()
    assert shape(again) == shape(scenario)
    assert from_yaml(document(values)).values() == again.values(), "however it is laid out"
    assert to_yaml(again) == to_yaml(scenario)


@pytest.mark.thorough
@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(scenarios())
def test_scenarios_run_or_are_refused_for_their_step(values: dict[str, Any]) -> None:
    """Breaks if a device of some kind ends in a traceback, gives other numbers in a batch, or is lost when saved."""
    scenario = Scenario.from_values(values)
    try:
        line_up(scenario)
    except InputError:
        return
    result = trainmj.run(scenario)
    summary = trainmj.summarise(result)
    assert summary.status
    json.dumps(summary.as_dict(), allow_nan=False)
    row = trainmj.run_cases(scenario, [{}], threads=1).iloc[0]
    for name, value in summary.row().items():
        same = (value == row[name]) or (value != value and row[name] != row[name])
        assert same, f"{name}: {row[name]} in a batch, {value} alone"
    with tempfile.TemporaryDirectory() as folder:
        result.save(Path(folder) / "result.nc")
        assert repeated(trainmj.load_result(Path(folder) / "result.nc"), result).same


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_good_file_of_each_kind_reads_the_same_twice(kind: Kind, tmp_path: Any) -> None:
    for name, content in good(kind).items():
        (tmp_path / name).write_bytes(content)
    file = tmp_path / kind.main
    first, second = result_of(kind.load(file)), result_of(kind.load(file))
    assert first
    assert first == second


SCHEMAS = {"scenario": BASE, "sweep": SWEEP, "study": STUDY, "targets": TARGETS}
BOTH = [
    ("scenario", ("devices", "head"), {"curve": "buffer"}),
    ("scenario", ("devices", "link"), {"stages": {"a": {"curve": "buffer"}}}),
    ("scenario", ("curves", "tube"), {"stroke_mm": [0, 1], "force_kN": [0, 1]}),
    ("sweep", ("sample", "factors", "devices.link.stiffness_kN_per_mm"), {"normal": [250, 10]}),
    ("sweep", ("vary", "gap"), {"step": 1}),
    ("study", ("design",), {"levels": {"D": 3}}),
    ("study", ("surrogates", "TS"), {"order": 2}),
    ("targets", ("parameters", "k"), {"curve": "curves.buffer"}),
    ("targets", ("data", "measured"), {"rows": [{"M": 1}]}),
]
"""What belongs to one alternative, added to another one."""


def schema_of(kind: str) -> Draft202012Validator:
    code, output = command("schema", kind)
    assert code == 0
    return Draft202012Validator(json.loads(output))


@pytest.mark.parametrize(("kind", "values"), [*SCHEMAS.items(), ("scenario", EVERY)])
def test_schemas_take_files_that_use_every_key(kind: str, values: dict[str, Any]) -> None:
    assert [error.message for error in schema_of(kind).iter_errors(values)] == []


@pytest.mark.parametrize(("kind", "path", "more"), BOTH)
def test_schema_and_loader_refuse_two_alternatives_at_once(
    kind: str, path: tuple[str, ...], more: dict[str, Any], tmp_path: Any
) -> None:
    wrong = replaced(SCHEMAS[kind], path, lambda part: part | more)
    assert list(schema_of(kind).iter_errors(wrong))
    files = good(next(k for k in KINDS if k.name == kind)) | {"wrong.yaml": document(wrong).encode()}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    load = next(k.load for k in KINDS if k.name == kind)
    with pytest.raises(InputError, match=r"does not go with|belongs to|unknown key"):
        load(tmp_path / "wrong.yaml")


def test_a_part_of_a_device_may_be_changed_in_a_file_that_builds_on_another() -> None:
    changed = {"builds_on": "base.yaml", "devices": {"head": {"damping_kN_s_per_m": 5}}}
    assert not list(schema_of("scenario").iter_errors(changed))
    assert list(schema_of("scenario").iter_errors(replaced(changed, ("builds_on",), lambda _: 5)))
    back = {
        "builds_on": "base.yaml",
        "limits": {"TS_mm": None},
        "devices": {"head": {"damping_kN_s_per_m": None}},
    }
    assert not list(schema_of("scenario").iter_errors(back))
    assert list(schema_of("scenario").iter_errors(BASE | {"limits": {"TS_mm": None}}))


def result_of(loaded: Any) -> str:
    """All that follows from a file."""
    if isinstance(loaded, Scenario):
        return repr((loaded.values(), loaded.model_dump()))
    if isinstance(loaded, Sweep):
        return repr((to_yaml(loaded.scenario), loaded.blocks, loaded.responses, loaded.histories))
    if isinstance(loaded, Study):
        return repr((loaded.spec, loaded.space, loaded.responses, to_yaml(loaded.scenario)))
    if isinstance(loaded, Standard):
        return repr((loaded.spec, loaded.name, loaded.source.values))
    if isinstance(loaded, trainmj.Reliability):
        return repr(
            (loaded.spec, [to_yaml(s) for s in loaded.scenarios.values()], loaded.scatter.names, loaded.draws(0, 9))
        )
    unknowns = loaded.unknowns
    samples = [(s.observations, s.wanted, s.tolerance, s.bar) for s in (loaded.fitted, loaded.held_out)]
    return repr((loaded.spec, unknowns.parameters, unknowns.constraints, unknowns.curves, loaded.targets, samples))
