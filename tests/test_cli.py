"""The command line as a person types it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import click
import mujoco
import numpy as np
import pandas as pd
import pytest
from builders import ALONG, SHIPPED, few
from click.testing import CliRunner, Result
from jsonschema import Draft202012Validator
from pages import ROOT

from trainmj.cli import main
from trainmj.collision.saved import load_result
from trainmj.collision.summary import Summary
from trainmj.files.sealed import unsealed
from trainmj.files.yaml import read_yaml
from trainmj.output.text_plot import Line, text_plot
from trainmj.scenario import load, shipped

SHORT = ("--set", "simulation.time_limit_s=0.1")


def trainmj(*args: str) -> Result:
    return CliRunner().invoke(main, args, prog_name="trainmj")


def works(*args: str) -> str:
    result = trainmj(*args)
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    return result.stdout


def fails(*args: str, code: int = 2) -> str:
    """What is said on stderr; nothing on stdout, no traceback."""
    result = trainmj(*args)
    assert result.exit_code == code, result.output
    assert isinstance(result.exception, SystemExit), f"a traceback: {result.exception!r}"
    assert result.stdout == ""
    return result.stderr


# as a process of its own


def test_run_as_a_process_prints_tables_of_80_columns(python):
    done = python("-m", "trainmj", "run", "b_type", *SHORT)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert max(len(line.rstrip()) for line in done.stdout.splitlines()) <= 80
    for word in ("S1-M1", "M5-M6", "S6", "kN", "kJ", "km/h", "TS", "TAMA", "Status: time limit"):
        assert word in done.stdout


def test_a_mistake_as_a_process_ends_in_one_message_and_exit_code_2(python):
    done = python("-m", "trainmj", "run", "b_type", "--set", "mas_t=33")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert "did you mean 'mass_t'" in done.stderr
    assert "Traceback" not in done.stderr


HEAVY = """
import sys
from click.testing import CliRunner
from trainmj.cli import main
heavy = {"numba", "mujoco", "matplotlib", "pandas", "xarray", "scipy", "pydantic", "numpy", "rich"}
for line in sys.argv[1:]:
    assert CliRunner().invoke(main, line.split()).exit_code == 0, line
    print(line, *sorted(heavy & set(sys.modules)), sep=",")
"""


def test_help_imports_nothing_heavy_and_a_list_neither_figures_nor_tables(python):
    """Help that loads the engine first answers in two seconds instead of at once."""
    helps = [f"{name} --help".strip() for name in ("", *main.commands)]
    done = python("-c", HEAVY, *helps, "--version", "scenarios")
    assert done.returncode == 0, done.stderr
    *nothing, listing = done.stdout.splitlines()
    assert nothing == [*helps, "--version"], "line by line, with what is heavy behind it"
    assert not {"matplotlib", "pandas", "xarray"} & set(listing.split(","))


PLAIN = """
import sys
from trainmj.cli import main
for words in (["run", "b_type"], ["run", "b_type", "--out", "out"]):
    try:
        sys.argv[1:] = words
        main()
    except SystemExit as end:
        assert not end.code, end
    slow = {"numba", "matplotlib", "PIL", "pandas", "xarray", "scipy", "dask", "jinja2", "glfw", "mujoco.batch"}
    print(*words, *sorted(slow & set(sys.modules)), sep=",")
"""


def test_a_run_imports_only_what_it_uses(python, tmp_path, standard_result):
    """Breaks if a collision, which takes hundredths of a second, waits for packages that have no part in it."""
    done = python("-c", PLAIN, cwd=tmp_path, MPLCONFIGDIR=str(tmp_path))
    said = [line for line in done.stdout.splitlines() if line.startswith("run,")]
    assert said == ["run,b_type", "run,b_type,--out,out,PIL,matplotlib"], done.stderr


@pytest.mark.thorough
def test_a_reader_that_goes_away_is_no_error(python, tmp_path):
    """As in ``trainmj export b_type | head -1``."""
    script = (
        "import subprocess, sys\n"
        "p = subprocess.Popen([sys.executable, '-m', 'trainmj', 'export', 'b_type'], stdout=subprocess.PIPE, "
        "stderr=subprocess.PIPE)\n"
        "p.stdout.readline(); p.stdout.close()\n"
        "print(p.stderr.read().decode(), p.wait())\n"
    )
    done = python("-c", script)
    assert "Traceback" not in done.stdout
    assert done.stdout.split()[-1] == "0"


# help


@pytest.mark.parametrize("command", [None, *sorted(main.commands)])
@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_of_every_command(command, flag):
    text = works(*([command] if command else []), flag)
    assert text.startswith("Usage: ")
    assert max(len(line) for line in text.splitlines()) <= 100
    if command:
        assert main.commands[command].help, "a command without a sentence about it"
        for option in (p for p in main.commands[command].params if isinstance(p, click.Option)):
            assert option.help, f"{command} {option.name} has no help"


def test_version():
    assert "trainmj, version" in works("--version")


# run


@pytest.fixture(scope="module")
def printed(tmp_path_factory) -> tuple[dict[str, Any], Path]:
    """The standard run with --json and --out."""
    out = tmp_path_factory.mktemp("run") / "made" / "for it"
    return json.loads(works("run", "b_type", "--json", "--out", str(out))), out


def test_json_has_the_agreed_structure(printed, standard_summary: Summary):
    found, _ = printed
    assert found["status"] == "over"
    assert found["criteria"] == {"TS_mm": standard_summary.TS_mm, "TAMA_g": standard_summary.TAMA_g}
    interfaces = {"name", "stroke_mm", "permanent_mm", "peak_force_kN", "energy_kJ"}
    assert all(interfaces <= set(i) for i in found["interfaces"])
    vehicles = {
        "name", "mass_t", "peak_device_acceleration_g", "peak_acceleration_g", "final_speed_km_h", "balance_time_s",
    }  # fmt: skip
    assert all(vehicles <= set(v) for v in found["vehicles"])
    assert [i["name"] for i in found["interfaces"]] == [i.name for i in standard_summary.interfaces]
    assert [v["name"] for v in found["vehicles"]] == [v.name for v in standard_summary.vehicles]
    assert found["interfaces"][0]["stroke_mm"] == standard_summary.interfaces[0].stroke_mm
    assert found["vehicles"][0]["mass_t"] == 33
    assert abs(found["balance"]["energy_error"]) <= 1e-3
    assert abs(found["balance"]["momentum_error"]) <= 1e-9


def test_out_writes_result_tables_scenario_and_figure(printed, standard_result):
    found, out = printed
    tables = {"histories.csv", "interfaces.csv", "vehicles.csv"}
    assert {p.name for p in out.iterdir()} == {"result.nc", "scenario.yaml", "summary.json", "collision.png"} | tables
    assert load_result(out / "result.nc").tally.dissipated.tolist() == standard_result.tally.dissipated.tolist()
    assert load(out / "scenario.yaml").values() == standard_result.scenario.values()
    assert unsealed((out / "summary.json").read_bytes()) == found
    assert len(pd.read_csv(out / "histories.csv")) == len(standard_result.time)
    interfaces, vehicles = pd.read_csv(out / "interfaces.csv"), pd.read_csv(out / "vehicles.csv")
    assert interfaces["stroke_mm"].tolist() == pytest.approx([i["stroke_mm"] for i in found["interfaces"]])
    assert vehicles["final_speed_km_h"].tolist() == pytest.approx([v["final_speed_km_h"] for v in found["vehicles"]])
    assert (out / "collision.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "collision.png").stat().st_size > 30_000, "an empty figure"


def test_numbers_that_json_cannot_hold_are_null_everywhere(tmp_path):
    """The filtered peak is undefined with records 10 ms apart; NaN is not JSON, and other programs refuse it."""

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} in JSON")

    words = (*SHORT, "--json", "--out", str(tmp_path), "--figures", "none")
    text = works("run", "b_type", "--set", "simulation.record_every_ms=10", *words)
    found = json.loads(text, parse_constant=refuse)
    assert found["vehicles"][0]["cfc60_peak_g"] is None
    json.loads((tmp_path / "summary.json").read_text(), parse_constant=refuse)
    assert unsealed((tmp_path / "summary.json").read_bytes()) == found


def test_settings_of_the_paper():
    text = works("check", "b_type", "--set", "empty_stroke_mm=35", "--set", "mass_t=31.25", "--set", "speed_km_h=25")
    assert "31.25" in text
    found = json.loads(works("run", "b_type", "--set", "mass_t=31.25", *SHORT, "--json"))
    assert {v["mass_t"] for v in found["vehicles"]} == {31.25}


@pytest.mark.parametrize("name", [*ALONG, *few([p[0] for p in SHIPPED if p not in ALONG], 0)])
def test_every_shipped_scenario_runs_and_prints_within_80_columns(name):
    text = works("run", name)
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    assert any(f"Status: {status}" in text for status in ("over", "stroke exhausted", "limit passed"))


def test_a_passed_limit_is_marked():
    text = works("run", "b_type", "--set", "speed_km_h=30")
    assert "stroke exhausted at S1-M1 anti_climber" in text
    (line,) = (line for line in text.splitlines() if line.startswith("stroke of front anti_climber"))
    assert "159  FAIL" in line
    assert re.search(r"^\s+anti_climber .* > 265\s*$", text, re.MULTILINE)


def test_a_column_of_limits_is_there_only_if_there_are_limits():
    """Breaks if a table widens by a column of blanks."""
    texts = [
        works("run", name).partition("Interfaces")[2].partition("Vehicles")[0] for name in ("fra_cem_two", "b_type")
    ]
    assert ["limit" in text for text in texts] == [False, True]


def test_titles_are_printed_as_they_are(tmp_path):
    """Square brackets are markup to the library that prints."""
    file = tmp_path / "my.yaml"
    file.write_text('builds_on: b_type\ntitle: "[bold]D = 22[/bold] [/x] :smile:"\n')
    for command in ("run", "check"):
        assert "[bold]D = 22[/bold] [/x] :smile:" in works(command, str(file), *SHORT)


# check, scenarios, schema, export


def test_check_finds_a_shipped_file_whose_name_no_scenario_has():
    """Breaks if what ``trainmj identify`` takes by its name is no such file to ``trainmj check``."""
    assert "2 values sought from 3 in 2 cases" in works("check", "fra_cem")


def test_check_prints_what_would_run():
    text = works("check", "wagon_80t")
    for word in ("M8", "S1", "80", "wagon_buffers", "absorber", "(3000)", "Step 0.1 ms"):
        assert word in text
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80


def test_check_says_and_draws_what_each_device_is():
    """Breaks if a user cannot see that a device is another one than was meant, or has no end."""
    text = works("check", str(ROOT / "tests" / "every_kind.yaml"))
    flat = " ".join(text.split())
    for words in (
        "crush, rate C 20", "hysteresis", "gas_hydraulic", "anti_climber", "breaks at", "nothing stated", "Grade",
        "open: nothing is stated behind the end of the curve", "State beyond: car_body, stop or hold.", "brake",
        "coupler: in a step of 0.1 ms it is pressed by up to 0.694 mm, and a peak of its curve is 0.25 mm wide",
        "oil, + at 6.94 m/s", "Not drawn: open, gas;",
    ):  # fmt: skip
        assert words in flat, words
    for behind in ("car body from 384 mm", "stop from 105 mm: 100 kN/mm", "held from 400 mm: 800 kN"):
        assert all(word in flat for word in behind.split())
    assert text.count("+------") == 4, "four plots, however many devices there are"
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    assert "a peak of its curve" not in works("check", "wagon_80t")


def test_a_plot_of_characters_shows_the_curve():
    """Breaks if a plot for the terminal is upside down, or loses a peak narrower than a character."""
    x = np.array([0.0, 10.0, 44.9, 45.0, 45.1, 100.0])
    line = Line("*", x, np.array([0.0, 500.0, 500.0, 1000.0, 500.0, 500.0]))
    title, *rows, axis, foot = text_plot("tube", [line], "mm", 32, 5).splitlines()
    assert title == "tube"
    assert [row.partition("|")[0].strip() for row in rows] == ["1000", "", "", "", "0"]
    assert [row.count("*") for row in rows[:2]] == [1, 1], "the peak"
    assert rows[2].count("*") >= 22
    assert rows[4].partition("|")[2].startswith("*")
    assert axis.strip() == "+" + "-" * 26
    assert foot.split() == ["0", "mm", "100"]


@pytest.mark.parametrize(
    ("file", "words"),
    [
        (
            "examples/sweep/speeds.yaml",
            ["Sweep: 34 cases", "speed_km_h", "16 to 32", "0, 0.008", "26 of 196", "All cases"],
        ),
        ("scenarios/paper/b_type.study.yaml", ["Study: 10 points", "empty_stroke_mm", "20 to 50 mm", "<= 265 mm"]),
        ("b_type.study.yaml", ["Study: 10 points"]),
        ("examples/study/plateaus.study.yaml", ["Study: 20 points", "minimise", "head_kN"]),
        (
            "b_type.targets.yaml",
            ["10 values sought from 196 in 17 cases; 52 more", "1600 trials in each of 10", "t_M3"],
        ),
    ],
)
def test_check_takes_every_kind_of_input_file(file, words):
    """Breaks if check calls a right file of another kind wrong, or says nothing of what it would do."""
    text = works("check", str(ROOT / file) if "/" in file else file)
    for word in (*words, "Vehicles along the track", "Step 0."):
        assert word in text
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80


SMALL = {
    "scenario": "scenario: b_type",
    "sweep": "vary: {mass_t: '30,33'}",
    "study": "factors: {M: {sets: mass_t, bounds: [30, 33]}}\nobjectives: {TS: minimise}",
    "targets": "targets: {}\ndata: {}",
}
TAKES = {"run": "scenario", "export": "scenario", "sweep": "sweep", "study": "study", "identify": "targets"}


@pytest.mark.parametrize("command", TAKES)
@pytest.mark.parametrize("kind", ["scenario", "sweep", "study", "targets"])
def test_a_file_of_another_kind_is_named_in_one_message(tmp_path, command, kind):
    """Breaks if a study that is given to sweep is refused key by key."""
    file = tmp_path / "mine.yaml"
    file.write_text("builds_on: b_type\n" if kind == "scenario" else f"{SMALL['scenario']}\n{SMALL[kind]}\n")
    out = ("--out", str(tmp_path / "out"))
    if kind == TAKES[command] or (command, kind) == ("sweep", "scenario"):
        return
    message = fails(command, str(file), *out)
    assert re.fullmatch(
        rf"Error: {re.escape(str(file))}: is not a {TAKES[command]} file, which states .*, but a {kind} file: "
        r"trainmj \w+ or trainmj\.load\w* reads it\n",
        message,
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("my.sweep.yaml", "scenario: b_type\n", "nothing is varied"),
        ("my.yaml", "vary: {mass_t: '30,33'}\n", "my.yaml: scenario: is missing"),
        ("my.yaml", "scenario: b_type\nvary: {mas_t: '30,33'}\n", "did you mean 'mass_t'"),
        ("my.study.yaml", "scenario: b_type\nfactors: {M: {sets: mass_t, bounds: [3, 1]}}\n", "3 is not below 1"),
        ("my.yaml", "title: \xe9\n", "is not UTF-8 text (line 1): save it as UTF-8"),
        ("result.nc", "", "is not a readable NetCDF file"),
    ],
)
def test_check_says_what_is_wrong_with_every_kind_of_file(tmp_path, name, text, said):
    (tmp_path / name).write_text(text, encoding="latin-1")
    assert said in fails("check", str(tmp_path / name))


def test_check_of_a_sweep_says_how_many_cases_would_be_refused(tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text(
        "scenario: wagon_80t\nvary: {simulation.step_ms: [0.1, 0.3, 100]}\nresponses: [TS_mm]\nhistories: [0]\n"
    )
    text = works("check", str(file))
    assert "Responses: 1 of " in text
    assert "Histories: of the cases 0" in text
    assert "Note: 2 of 3 cases would be refused; the first, case 1: change: " not in text
    assert "Note: 2 of 3 cases would be refused; the first, case 1: " in text


@pytest.mark.parametrize("command", ["check", "run"])
def test_what_gave_way_to_stages_is_said(command, tmp_path):
    """Breaks when a run drops a curve that the file below states, and does not say so."""
    file = tmp_path / "my.yaml"
    file.write_text(
        "builds_on: wagon_80t\n"
        "devices: {wagon_buffers: {stages: {only: {curve: {stroke_mm: [0, 500], force_kN: [500, 900]}}}}}\n"
    )
    said = works(command, str(file), "--set", "simulation.time_limit_s=0.05")
    assert f"Note: {file}:2:11: devices.wagon_buffers: curve" in said


def test_a_value_is_set_once():
    assert "--set mass_t=33: mass_t is set twice" in fails(
        "check", "b_type", "--set", "mass_t=30", "--set", "mass_t=33"
    )


def test_set_of_a_file_that_states_its_values_is_refused():
    assert "--set: the study file b_type.study.yaml states its values" in fails(
        "check", "b_type.study.yaml", "--set", "a=1"
    )


def test_scenarios_lists_what_ships_with_title_and_parameters():
    text = works("scenarios")
    for name in shipped():
        assert name in text
    assert "empty_stroke_mm" in text
    assert "EN 15227-type" in text
    assert "Studies: b_type" in text
    assert "Targets: b_type, b_type_s08, fra_cem" in text


SCHEMA_OF = {
    "scenario": "examples/study/tram.yaml",
    "sweep": "examples/sweep/speeds.yaml",
    "study": "scenarios/paper/b_type.study.yaml",
    "targets": "scenarios/paper/b_type.targets.yaml",
}


@pytest.mark.parametrize("kind", SCHEMA_OF)
def test_schemas_take_good_files_and_refuse_unknown_keys(kind):
    schema = json.loads(works("schema", kind))
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    good = dict(read_yaml(ROOT / SCHEMA_OF[kind]).values)
    assert not list(validator.iter_errors(good))
    assert list(validator.iter_errors(good | {"spead_km_h": 3}))


def test_schema_is_that_of_scenarios_if_no_kind_is_given():
    assert works("schema") == works("schema", "scenario")


def test_export_writes_a_model_that_reloads(tmp_path):
    file = tmp_path / "model.xml"
    works("export", "b_type", "--set", "mass_t=31", "--out", str(file))
    model = mujoco.MjModel.from_xml_path(str(file))
    assert model.body_mass[1:].tolist() == [31e3] * 12
    assert mujoco.MjModel.from_xml_string(works("export", "b_type")).nv == 12


# mistakes


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("run", "nowhere.yaml"), "nowhere.yaml: there is no such file or shipped scenario"),
        (("check", "b_tpye"), "did you mean 'b_type'"),
        (("run", "."), "is a folder"),
        (("run", "b_type", "--set", "mass_t"), "must be PATH=VALUE, as in --set mass_t=33"),
        (("run", "b_type", "--set", "mass_t="), "must be PATH=VALUE"),
        (("run", "b_type", "--set", "=33"), "must be PATH=VALUE"),
        (("run", "b_type", "--set", "mass_t=[1"), "is not valid YAML"),
        (("run", "b_type", "--set", "mass_t=heavy"), "must be a number"),
        (("run", "b_type", "--set", "mass_t=-1"), "must be at least 0.001"),
        (("run", "b_type", "--set", "mass_t=nan"), "must be a"),
        (("run", "b_type", "--set", "a\nb=1"), "there is no"),
        (("run", "b_type", "--set", "collision.gap=5"), "unknown key; did you mean 'gap_mm'"),
        (
            ("run", "b_type", "--set", "simulation.integrator=RK4"),
            "must be 'euler', 'events', 'implicitfast' or 'implicit'",
        ),
        (("run", "b_type", "--set", "simulation.step_ms=1"), "simulation.step_ms = 1: must be at most"),
        (("export", "b_type", "--out", "/nowhere/model.xml"), "cannot be written"),
        (("run", "b_type", "--out", "/dev/null/x"), "cannot be made a folder"),
    ],
)
def test_mistakes_end_in_exit_code_2_and_a_message(args, said):
    message = fails(*args)
    assert message.startswith("Error: ")
    assert said in message


@pytest.mark.parametrize("args", [("rnu",), ("run",), ("run", "b_type", "--nosuch"), ("run", "b_type", "b_type")])
def test_wrong_use_ends_in_exit_code_2_and_the_usage(args):
    result = trainmj(*args)
    assert result.exit_code == 2
    assert "Usage:" in result.stderr


def test_check_of_an_unstable_step_says_so():
    result = trainmj("check", "b_type", "--set", "simulation.step_ms=1")
    assert result.exit_code == 2
    assert "must be at most" in result.stderr


def test_a_bad_file_is_named_with_line_and_column(tmp_path):
    file = tmp_path / "my.yaml"
    file.write_text("builds_on: b_type\ncollision: {spead_km_h: 20}\n")
    assert f"{file}:2:13: collision.spead_km_h = 20: unknown key; did you mean 'speed_km_h'" in fails("run", str(file))


def test_a_mistake_is_found_before_a_folder_is_made(tmp_path):
    fails("run", "b_type", "--set", "mass_t=-1", "--out", str(tmp_path / "new"))
    assert not (tmp_path / "new").exists()
