"""The kinds of file that people hand to trainmj, each with a good example and what a user does with it.

Another kind of file is one more entry of KINDS.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from builders import METRO, STRUT
from click.testing import CliRunner

import trainmj
from trainmj.cli import main
from trainmj.errors import EngineError, InputError, TrainmjError
from trainmj.identification import Identification, load_targets
from trainmj.scenario import Scenario
from trainmj.view import offscreen

BASE = {
    "title": "Two wagons against a wall",
    "notes": "Small enough to run hundreds of times.",
    "parameters": {"mass_t": "trains.wagons.mass_t", "gap": ["devices.head.stages.climber.empty_stroke_mm"]},
    "curves": {"buffer": {"stroke_mm": [0, 40, 73], "force_kN": [0, 600, 800]}, "tube": {"file": "tube.csv"}},
    "devices": {
        "head": {
            "stages": {
                "coupler": {
                    "curve": ["buffer", {"stroke_mm": [350], "force_kN": [800]}],
                    "shear_off": {"force_kN": 1000, "ramp_mm": 0.3},
                },
                "climber": {"empty_stroke_mm": 30, "curve": "tube", "stroke_limit_mm": 265},
            },
            "stiffness_kN_per_mm": 300,
            "damping_kN_s_per_m": 10,
        },
        "link": {"curve": {"stroke_mm": [0, 73, 500], "force_kN": [0, 800, 800]}, "stiffness_kN_per_mm": 300},
    },
    "trains": {
        "wagons": {
            "vehicles": [{"name": "A"}, {"name": "B", "mass_t": 36}],
            "mass_t": 40,
            "length_m": 18,
            "front": "head",
            "rear": "link",
            "coupler": "link",
        }
    },
    "collision": {"train": "wagons", "speed_km_h": 12, "partner": "rigid_wall", "rail_friction": 0.008},
    "simulation": {"step_ms": 0.2, "record_every_ms": 1, "time_limit_s": 0.05},
}
TUBE = b"stroke_mm,force_kN\n0,0\n1,1250\n400,1250\n"
FACE = {"acts": "face", "height_mm": 950, "overlap_mm": 120, "tie": {"friction": 0.2, "tooth_kN": 5, "kN_per_mm": 100}}
BOGIES = METRO | {
    "body": METRO["body"] | {"cog_x_m": 0.1},
    "bogies": METRO["bogies"] | {"centres_m": 11},
    "primary": {"kN_per_mm": 3.4, "kN_s_per_m": 20, "lift_stop_mm": "none", "bump_stop_mm": "none"},
    "rail": {"kN_per_mm": 1200, "kN_s_per_m": 100},
}
EVERY = {
    "title": "Every kind of device, train and obstacle",
    "plane": "vertical",
    "ties": "stated",
    "bracket": ["free", "stated"],
    "vehicle_types": {"carriage": BOGIES},
    "curves": {"buffer": {"stroke_mm": [0, 40, 73], "force_kN": [0, 600, 800]}, "tube": {"file": "tube.csv"}},
    "devices": {
        "plain": {"kind": "crush", "curve": "tube", "stiffness_kN_per_mm": 300, "beyond": "car_body", "line": FACE},
        "rising": {
            "curve": "buffer",
            "stiffness_kN_per_mm": 300,
            "rate": {"C_m_per_s": 20, "P": 5},
            "beyond": {"kind": "car_body", "collapse_force_kN": 1500, "stiffness_kN_per_mm": 200},
            "pull": {"stiffness_kN_per_mm": 50, "damping_kN_s_per_m": 5, "slack_mm": 20, "breaking_force_kN": 600},
        },
        "measured": {
            "curve": {"stroke_mm": [0, 1, 400], "force_kN": [0, 900, 900]},
            "stiffness_kN_per_mm": 300,
            "rate": {
                "curves": [
                    {"speed_m_per_s": 2, "curve": {"stroke_mm": [0, 400], "force_kN": [0, 1000]}},
                    {"speed_m_per_s": 5, "curve": {"file": "tube.csv"}},
                ]
            },
            "beyond": "hold",
        },
        "gear": {
            "kind": "hysteresis",
            "loading": ["buffer", {"stroke_mm": [90], "force_kN": [2000]}],
            "unloading": {"file": "back.csv"},
            "transition_stiffness_kN_per_mm": 250,
            "empty_stroke_mm": 50,
            "stroke_limit_mm": 80,
            "line": STRUT,
            "beyond": {"kind": "stop"},
            "pull": {"curve": {"file": "tube.csv"}, "stiffness_kN_per_mm": 300},
        },
        "oil": {
            "kind": "hydraulic",
            "stroke_mm": 105,
            "orifice_kN_s2_per_m2": 40,
            "preload_kN": 100,
            "preload_stiffness_kN_per_mm": 100,
            "empty_stroke_mm": 5,
            "stroke_limit_mm": 100,
            "beyond": {"kind": "stop", "stiffness_kN_per_mm": 100},
        },
        "gas": {
            "kind": "gas_hydraulic",
            "stroke_mm": 100,
            "metering": {"file": "metering.csv"},
            "gas": {"force_kN": 50, "length_mm": 120, "exponent": 1.3, "preload_stiffness_kN_per_mm": 100},
            "rebound_orifice_kN_s2_per_m2": 400,
            "beyond": {"kind": "car_body", "stiffness_kN_per_mm": 100},
        },
    },
    "trains": {
        "plain": {"vehicles": 2, "mass_t": 40, "front": "plain", "coupler": "plain", "type": "carriage"},
        "listed": {
            "vehicles": {"file": "vehicles.csv"},
            "mass_t": 33,
            "load": {"share": 0.5, "kg": 80},
            "brakes": {"force_kN": 33, "delay_s": 0.5, "rise_s": 1.5, "adhesion": 0.15},
            "rail_friction": 0.01,
            "coupler": ["gear", "oil"],
            "front": "gas",
            "rear": "measured",
            "drawing": "wagon",
        },
        "own": {
            "vehicles": [
                {
                    "name": "A",
                    "load": {"seats": 60, "share": 0.5, "kg": 80},
                    "brakes": {"deceleration_m_per_s2": 1},
                    "rail_friction": 0.02,
                    "coupler": ["rising", "rising"],
                },
                {"name": "B", "mass_t": 36},
            ],
            "mass_t": 30,
            "front": "rising",
        },
    },
    "obstacles": {
        "lorry": {"mass_t": 15, "length_m": 6, "front": "plain", "rail_friction": 0.3, "drawing": "lorry"},
        "stop": {"fixed": True, "front": "oil", "drawing": "buffer_stop"},
    },
    "collision": {"train": "plain", "speed_km_h": 12, "partner": "rigid_wall", "grade_per_mille": 0}
    | {"offset_mm": {"M": 40, "M2": 5}, "pitch_mrad": {"M1": 3}},
    "simulation": {"step_ms": 0.2, "time_limit_s": 0.05},
}
BACK = b"stroke_mm,force_kN\n0,0\n100,200\n"
METERING = b"stroke_mm,orifice_kN_s2_per_m2\n0,20\n50,40\n105,200\n"
VEHICLES = b"name,mass_t,length_m,coupler,type,seats,rail_friction\n007,30,18,plain,carriage,60,\nB,,,,,0,0.02\n"
SCENARIO = {"builds_on": "base.yaml", "title": "With a partner", "collision": {"partner": "wagons", "gap_mm": 5}}
SWEEP = {
    "scenario": "base.yaml",
    "set": {"collision.speed_km_h": 10},
    "vary": {"mass_t": [30, 33], "gap": {"from": 20, "to": 50, "count": 2}},
    "together": {"collision.gap_mm": [0, 5], "collision.rail_friction": [0.0, 0.01]},
    "cases": {"uphill": {"title": "Uphill", "scenario": "base.yaml", "set": {"collision.grade_per_mille": 1}}},
    "table": "cases.csv",
    "sample": {
        "count": 2,
        "seed": 1,
        "method": "random",
        "factors": {
            "devices.link.stiffness_kN_per_mm": {"uniform": [200, 300]},
            "devices.head.damping_kN_s_per_m": {"normal": [10, 1]},
            "trains.wagons.coupler": {"choice": ["link", "head"]},
        },
    },
    "responses": ["TS_mm", "stroke_*"],
    "histories": [0],
}
RELIABILITY = {
    "title": "Two wagons, as built",
    "notes": "All tolerances are made up.",
    "sources": {"tolerances.masses": {"mark": "assumed", "source": "a guess"}},
    "scenario": "base.yaml",
    "set": {"limits.TS_mm": 900},
    "tolerances": {
        "masses": {"of": "mass_t", "percent": 2, "copies": "same"},
        "tubes": {"of": ["devices.link"], "scales": "force", "sigma": 0.03, "correlated": {"gap": 0.3}},
        "gap": {"of": "gap", "kind": "truncated_normal", "sigma": 2, "range": [24, 36]},
        "friction": {"of": "collision.rail_friction", "kind": "discrete", "values": [0.005, 0.01]},
    },
    "cases": {"plain": {}, "faster": {"title": "1 km/h above", "set": {"collision.speed_km_h": 13}}},
    "runs": 6,
    "seed": 2,
    "draws": "random",
    "responses": ["TS_mm", "stroke_*"],
    "quantiles": [0.5, 0.95],
    "level": 0.9,
    "sensitivity": {"runs": 16, "responses": ["TS_mm"]},
}
CASES = b"trains.wagons.length_m\n18\n20\n"
STUDY = {
    "title": "Gap and mass",
    "scenario": "base.yaml",
    "set": {"collision.speed_km_h": 10},
    "factors": {
        "D": {"sets": "gap", "bounds": [20, 50], "unit": "mm"},
        "M": {"sets": ["mass_t"], "bounds": [30, 36], "kind": "integer"},
        "device": {"sets": "trains.wagons.front", "levels": ["link", "head"]},
    },
    "responses": {"TS": "TS_mm", "TAMA": "TAMA_g", "S": "stroke_M1_wall_mm"},
    "design": {"kind": "optimal_latin_hypercube", "n": 8, "seed": 1, "placement": "edge", "resolution": {"D": 1}},
    "correlation": {"methods": ["pearson"], "level": 0.9},
    "surrogates": {"default": {"order": 1}, "TS": {"terms": ["1", "D", "M"], "selection": "none"}},
    "cross_validation": {"against": [], "folds": 2, "seed": 1},
    "objectives": {"TS": "minimise", "TAMA": "maximise"},
    "constraints": {"S": {"at_most": 1000, "margin": 1}},
    "optimiser": {
        "on": "surrogate",
        "seed": 1,
        "resolution": {"D": 1},
        "surrogate": {"particles": 8, "iterations": 3, "archive": 8, "patience": 2, "tolerance": 0.01},
    },
    "weights": {"method": "own", "own": {"TS": 1, "TAMA": 2}},
    "decision": {"method": "weighted_sum", "normalisation": "min_max", "spread": 0.1, "seed": 1},
    "check": {"set": {"simulation.step_ms": 0.1}},
}
POINTS = b"D,M,device\n20,30,link\n30,31,head\n40,34,link\n50,36,head\n45,33,link\n"
STUDY_OF_POINTS = {
    **STUDY,
    "design": {"kind": "table", "file": "points.csv"},
    "surrogates": {"default": {"kind": "kriging", "seed": 1}},
    "weights": {"method": "entropy"},
    "optimiser": {"on": "simulator", "simulator": {"particles": 4, "iterations": 2, "archive": 4, "patience": 1}},
}
CART = {
    "title": "Cart",
    "notes": "Light.",
    "sources": {"obstacle.mass_t": {"mark": "assumed", "source": "a guess"}, "devices.cart_side": "a test"},
    "curves": {"side": {"file": "tube.csv"}},
    "devices": {"cart_side": {"curve": "side", "stiffness_kN_per_mm": 300, "stroke_limit_mm": 350, "beyond": "stop"}},
    "obstacle": {"mass_t": 20, "length_m": 4, "front": "cart_side", "rail_friction": 0.2, "drawing": "lorry"},
}
ASSESSMENT = {
    "title": "House rules",
    "edition": "of today",
    "notes": "Two scenarios.",
    "categories": {"yard": "in the yard", "C-I": "outside"},
    "load_states": {"full": {"share": 1, "kg": 80, "title": "all seats"}, "empty": {"share": 0}},
    "brakes": False,
    "set": {"collision.gap_mm": 0, "simulation.time_limit_s": 1.0},
    "limits": {"mean_deceleration_g": 5, "TS_mm": 500, "body_plastic_5m_mm": 50},
    "reported": ["mean_120ms_g", "stroke_M1_M2_mm"],
    "scenarios": {
        "twin": {"title": "Into a twin", "partner": "identical", "speed_by_category_km_h": {"yard": 12, "C-I": 10}},
        "cart": {
            "title": "Into a cart",
            "partner": "cart",
            "speed_km_h": {"line_speed_less_km_h": 5, "at_most_km_h": 20},
            "ends": ["front"],
            "limits": {"TS_mm": None, "TAMA_g": 5},
            "set": {"collision.rail_friction": 0.0},
            "notes": "A light one.",
        },
    },
    "not_computed": {"noise": "no matter of collisions"},
    "sources": {"limits.TS_mm": {"mark": "read", "source": "page 3"}, "scenarios.twin.speed_by_category_km_h": "us"},
}
WANTED = b"M,S,TS\n30,40,70\n33,42,\n36,45,75\n"
TARGETS = {
    "title": "The link",
    "notes": "Values that nobody measured.",
    "scenario": "base.yaml",
    "set": {"collision.speed_km_h": 10},
    "parameters": {
        "k": {"sets": "devices.link.stiffness_kN_per_mm", "bounds": [100, 600], "scale": "log", "start": 200},
        "f": {
            "sets": ["devices.link.curve.force_kN.1", {"path": "devices.link.curve.force_kN.2", "offset": 1}],
            "bounds": [500, 900],
            "unit": "kN",
        },
        "b": {"curve": "curves.buffer", "slopes": 20},
        "c": {"sets": "devices.head.damping_kN_s_per_m", "bounds": [1, 50]},
        "d": {"sets": "devices.head.stiffness_kN_per_mm", "bounds": [100, 600], "above": "c", "gap": 10},
    },
    "constraints": {"energy": {"of": "curves.buffer", "from_mm": 0, "to_mm": 73, "area_kJ": 35.1, "by": "b"}},
    "targets": {
        "S": {"response": "stroke_M1_wall_mm", "tolerance": "1 %", "bars": {"each": 500, "rms": "900 %"}},
        "TS": {"response": "TS_mm - 0.5 * stroke_M1_M2_mm", "tolerance": 4, "weight": 2},
        "a": {"response": "peak_device_M2_g", "tolerance": 0.1, "bars": {"bias": 100}},
    },
    "data": {
        "measured": {
            "table": "wanted.csv",
            "leave_out": {"M": [33]},
            "cases": {"M": "mass_t"},
            "set": {"gap": 40},
            "values": {"S": "S", "TS": "TS - 0.1 * S"},
        },
        "typed": {"rows": [{"M": 35, "a": 1.1}, {"M": 36, "a": 1.0}], "cases": {"M": "mass_t"}, "values": {"a": "a"}},
    },
    "held_out": {"more": {"table": ["wanted.csv"], "where": {"M": 33}, "cases": {"M": "mass_t"}, "values": {"S": "S"}}},
    "method": {
        "seed": 1,
        "bar_weight": 3,
        "explore": {
            "trials": 8,
            "searches": 2,
            "population": 4,
            "spread": 0.2,
            "start": "middle",
            "slope_ratio": 3,
            "cases": 2,
            "step_ms": 0.25,
        },
        "refine": {"iterations": 1, "starts": 1, "difference": 0.01},
        "finish": {"norm": 8, "iterations": 1},
    },
}


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        name: of the kind.
        main: name of the file that is handed to trainmj.
        files: gives good values, or bytes, of it and of the files it names.
        load: reads it without computing.
        cost: of computing what was loaded, in steps of a vehicle.
        use: what a user does with it, the folder for results given; gives the exit code and what was printed.
    """

    name: str
    main: str
    files: Callable[[], Mapping[str, Any]]
    load: Callable[[Path], Any]
    cost: Callable[[Any], float]
    use: Callable[[Path, Path], list[tuple[int, str]]]


def command(*args: str | Path) -> tuple[int, str]:
    """Exit code and output of a command in this process; what is no clean exit is raised."""
    result = CliRunner().invoke(main, [str(a) for a in args], prog_name="trainmj", catch_exceptions=False)
    return result.exit_code, result.output


def cost_of_scenario(scenario: Scenario) -> float:
    chain = trainmj.line_up(scenario)
    return chain.time_limit / chain.step * len(chain.vehicles)


def cost_of_sweep(plan: Any) -> float:
    if len(plan) > 40:
        return float("inf")
    cost = 0.0
    for number in range(len(plan)):
        try:
            cost += cost_of_scenario(plan.scenario_of(number))
        except InputError:
            continue
    return cost * (1 + len(plan.histories))


def cost_of_study(study: Any) -> float:
    design, optimiser = study.spec.design, study.spec.optimiser
    if design.kind in ("full_factorial", "central_composite"):
        return float("inf")  # the number of points is not known before the design
    runs = getattr(design, "n", 8) + (
        optimiser.simulator.particles * optimiser.simulator.iterations if optimiser.on != "surrogate" else 0
    )
    guesses = optimiser.surrogate.particles * optimiser.surrogate.iterations * (optimiser.on != "simulator")
    return runs * cost_of_scenario(study.scenario) + 1e3 * guesses + 250.0 * runs**2


def cost_of_targets(plan: Identification) -> float:
    method = plan.spec.method
    steps = method.refine.iterations * method.refine.starts + (method.finish.iterations if method.finish else 0) + 2
    explored = method.explore.trials * method.explore.searches + (method.explore.population or 20)
    trials = explored + steps * (plan.unknowns.n_axes + 2)
    fine = min(method.explore.step_ms or 1, method.refine.step_ms or 1, plan.scenario.simulation.step_ms)
    cases = [*plan.fitted.cases, *plan.held_out.cases]
    costs = [0.0]
    for case in cases[:40]:
        try:
            costs.append(cost_of_scenario(plan.scenario.with_values(case)))
        except InputError:
            continue
    return trials * len(cases) * max(costs) * plan.scenario.simulation.step_ms / fine


def cost_of_assessment(standard: trainmj.Standard) -> float:
    spec = standard.spec
    cases = sum(len(scenario.ends) for scenario in spec.scenarios.values()) * max(1, len(spec.load_states))
    return cases * 1e3


def use_assessment(file: Path, out: Path) -> list[tuple[int, str]]:
    words = ("assess", file.parent / "base.yaml", "--standard", file, "--category", "yard", "--threads", "1")
    return [command("check", file), command(*words, "--out", out / "assessed", "--report")]


def cost_of_reliability(plan: trainmj.Reliability) -> float:
    spec, scatter = plan.spec, plan.scatter
    parts = len(set(scatter.parts))
    runs = spec.runs + (spec.sensitivity.runs * 2 * (parts + 2) if spec.sensitivity else 0)
    runs += 20 * spec.rare.runs * spec.rare.levels if spec.rare else 0
    return runs * sum(map(cost_of_scenario, plan.scenarios.values()))


def use_reliability(file: Path, out: Path) -> list[tuple[int, str]]:
    words = ("reliability", file, "--out", out / "built", "--threads", "1", "--figures", "none")
    return [command("check", file), command(*words, "--draw", "3"), command(*words, "--report")]


def into(file: Path) -> Scenario:
    """A scenario that runs into the partner of a file."""
    return trainmj.load(file.parent / "base.yaml", {"collision.partner": file.name.partition(".")[0]})


def use_partner(file: Path, out: Path) -> list[tuple[int, str]]:
    return [command("check", file), command("run", file.parent / "base.yaml", "--set", "collision.partner=cart")]


def use_scenario(file: Path, out: Path) -> list[tuple[int, str]]:
    return [
        command("check", file),
        command("export", file, "--out", out / "model.xml"),
        command("run", file),
    ]


def use_sweep(file: Path, out: Path) -> list[tuple[int, str]]:
    return [command("sweep", file, "--out", out / "sweep", "--threads", "1")]


def use_study(file: Path, out: Path) -> list[tuple[int, str]]:
    """As the command does, but without the figures, which take longer than all else together."""
    try:
        result = trainmj.run_study(trainmj.load_study(file), out / "study", threads=1, figures=())
    except TrainmjError as error:
        return [(2, f"Error: {error}")]
    return [(0 if result.summary["check"]["kept"] else 1, "")]


def use_targets(file: Path, out: Path) -> list[tuple[int, str]]:
    return [command("identify", file, "--out", out / "identified", "--threads", "1", "--figures", "none")]


@cache
def draws() -> bool:
    """Whether this machine can draw without a screen."""
    try:
        offscreen.check_platform()
    except EngineError:
        return False
    return True


def use_result(file: Path, out: Path) -> list[tuple[int, str]]:
    still = ("--size", "128x72", "--fast", "--at", "0.02")
    return [
        command("report", file, "--out", out / "report.html"),
        command("run", file),
        *([command("render", file, "--out", out / "still.png", *still)] if draws() else []),
    ]


def use_folder(file: Path, out: Path) -> list[tuple[int, str]]:
    return [command("report", file.parent, "--out", out / "report.html")]


@cache
def results_of(kind: str) -> Mapping[str, Any]:
    """The files that a good file of a kind leads to; JSON as values."""
    with tempfile.TemporaryDirectory() as name:
        for beside, values in {**BESIDE, "my.study.yaml": STUDY, "my.sweep.yaml": SWEEP, "cases.csv": CASES}.items():
            Path(name, beside).write_bytes(values if isinstance(values, bytes) else json.dumps(values).encode())
        folder = Path(name, "out")
        if kind == "study":
            trainmj.run_study(trainmj.load_study(Path(name, "my.study.yaml")), folder, threads=1, figures=())
        elif kind == "sweep":
            trainmj.run_sweep(Path(name, "my.sweep.yaml"), folder, threads=1)
        else:
            folder.mkdir()
            trainmj.run(trainmj.load(Path(name, "base.yaml"))).save(folder / "result.nc")
        files = {file.name: file.read_bytes() for file in folder.iterdir() if file.suffix in _LEFT[kind]}
    return {n: json.loads(content) if n.endswith(".json") else content for n, content in files.items()}


_LEFT = {"run": (".nc",), "sweep": (".sqlite",), "study": (".json", ".csv")}


BESIDE: dict[str, Any] = {"base.yaml": BASE, "tube.csv": TUBE}
KINDS = (
    Kind("scenario", "my.yaml", lambda: BESIDE | {"my.yaml": SCENARIO}, trainmj.load, cost_of_scenario, use_scenario),
    Kind(
        "scenario of every device",
        "every.yaml",
        lambda: {
            "every.yaml": EVERY,
            "tube.csv": TUBE,
            "back.csv": BACK,
            "metering.csv": METERING,
            "vehicles.csv": VEHICLES,
        },
        trainmj.load,
        cost_of_scenario,
        use_scenario,
    ),
    Kind(
        "partner",
        "cart.partner.yaml",
        lambda: BESIDE | {"cart.partner.yaml": CART},
        into,
        cost_of_scenario,
        use_partner,
    ),
    Kind(
        "assessment",
        "my.assessment.yaml",
        lambda: BESIDE | {"my.assessment.yaml": ASSESSMENT, "cart.partner.yaml": CART},
        trainmj.load_assessment,
        cost_of_assessment,
        use_assessment,
    ),
    Kind(
        "reliability",
        "my.reliability.yaml",
        lambda: BESIDE | {"my.reliability.yaml": RELIABILITY},
        trainmj.load_reliability,
        cost_of_reliability,
        use_reliability,
    ),
    Kind(
        "sweep",
        "my.sweep.yaml",
        lambda: BESIDE | {"my.sweep.yaml": SWEEP, "cases.csv": CASES},
        trainmj.load_sweep,
        cost_of_sweep,
        use_sweep,
    ),
    Kind(
        "study",
        "my.study.yaml",
        lambda: BESIDE | {"my.study.yaml": STUDY},
        trainmj.load_study,
        cost_of_study,
        use_study,
    ),
    Kind(
        "study of given points",
        "my.study.yaml",
        lambda: BESIDE | {"my.study.yaml": STUDY_OF_POINTS, "points.csv": POINTS},
        trainmj.load_study,
        cost_of_study,
        use_study,
    ),
    Kind(
        "targets",
        "my.targets.yaml",
        lambda: BESIDE | {"my.targets.yaml": TARGETS, "wanted.csv": WANTED},
        load_targets,
        cost_of_targets,
        use_targets,
    ),
)
RESULTS = (
    Kind("result", "result.nc", lambda: results_of("run"), lambda file: None, lambda loaded: 0.0, use_result),
    Kind("sweep folder", "results.sqlite", lambda: results_of("sweep"), lambda file: None, lambda _: 0.0, use_folder),
    Kind(
        "study folder", "summary.json", lambda: results_of("study"), lambda file: None, lambda loaded: 0.0, use_folder
    ),
)
"""What trainmj itself has written, and reads again."""
