"""One rule for sweep, study and identify: the same command goes on; other input or another law is said."""

import importlib.util
import json
import shutil
import sqlite3
from contextlib import closing
from hashlib import sha256
from pathlib import Path

import pytest
from builders import each_alone, signed
from click.testing import CliRunner
from ruamel.yaml import YAML

import trainmj
from trainmj.cli import main
from trainmj.collision import identity as identities
from trainmj.collision.identity import identity
from trainmj.files.folder import held
from trainmj.files.sealed import sealed, unsealed

TRAIN = {
    "devices": {
        "front": {"curve": {"stroke_mm": [0, 60, 400], "force_kN": [0, 600, 700]}, "stiffness_kN_per_mm": 100},
        "coupler": {"curve": {"stroke_mm": [0, 60, 400], "force_kN": [0, 500, 600]}, "stiffness_kN_per_mm": 50},
    },
    "trains": {"t": {"vehicles": 2, "mass_t": 30, "front": "front", "coupler": "coupler"}},
    "collision": {"train": "t", "speed_km_h": 10, "partner": "rigid_wall"},
    "simulation": {"step_ms": 0.1, "time_limit_s": 0.1},
}
STUDY = {
    "scenario": "train.yaml",
    "factors": {"V": {"sets": "collision.speed_km_h", "bounds": [8, 12]}},
    "responses": {"S": "stroke_M1_wall_mm", "A": "peak_device_M1_g"},
    "design": {"kind": "sobol", "n": 6, "seed": 1},
    "surrogates": {"default": {"order": 1}},
    "objectives": {"S": "minimise", "A": "minimise"},
    "optimiser": {"surrogate": {"particles": 6, "iterations": 2}},
    "cross_validation": {"against": []},
}
TARGETS = {
    "scenario": "train.yaml",
    "parameters": {"k": {"sets": "devices.front.stiffness_kN_per_mm", "bounds": [50, 200]}},
    "targets": {"s": {"response": "stroke_M1_wall_mm", "tolerance": "1 %"}},
    "data": {"tests": {"rows": [{"V": 9, "s": 60}, {"V": 10, "s": 70}], "cases": {"V": "collision.speed_km_h"},
                       "values": {"s": "s"}}},
    "method": {"seed": 1, "explore": {"trials": 8}, "refine": {"iterations": 1}},
}  # fmt: skip
COMMANDS = {
    "sweep": ("sweep", "train.yaml", "--vary", "collision.speed_km_h=9,10,11"),
    "study": ("study", "my.study.yaml", "--figures", "none"),
    "identify": ("identify", "my.targets.yaml", "--figures", "none"),
}
STORES = {"sweep": "results.sqlite", "study": "simulations.sqlite", "identify": "trials.sqlite"}


def inputs(place):
    place.mkdir(exist_ok=True)
    for name, values in (("train.yaml", TRAIN), ("my.study.yaml", STUDY), ("my.targets.yaml", TARGETS)):
        with (place / name).open("w", encoding="utf-8") as out:
            YAML().dump(values, out)


def do(place, command, *more):
    """A command that fills the folder of its own name; exit code and all that it printed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        done = CliRunner().invoke(main, [*COMMANDS[command], "--out", command, *more])
    assert "Traceback" not in done.output
    return done.exit_code, done.output


@pytest.fixture(scope="module")
def before(tmp_path_factory):
    """A folder in which the three commands have run."""
    place = tmp_path_factory.mktemp("before") / "place"
    inputs(place)
    for command in COMMANDS:
        code, said = do(place, command)
        assert code == 0, said
    return place


@pytest.fixture
def place(before, tmp_path):
    return Path(shutil.copytree(before, tmp_path / "place"))


def tables(folder):
    return {file.name: file.read_bytes() for file in folder.glob("*.csv")}


def later(monkeypatch, **parts):
    """As if other versions were installed."""
    now = tuple((identity() | parts).items())
    monkeypatch.setattr("trainmj.collision.identity._identity", lambda: now)


every_command = pytest.mark.parametrize("command", COMMANDS)


@pytest.mark.parametrize(
    ("command", "part"),
    [
        pytest.param(
            command, part, marks=[pytest.mark.thorough] * (command != "sweep" and part not in ("trainmj", "law"))
        )
        for command in COMMANDS
        for part in identity()
    ],
)
def test_numbers_of_another_identity_are_refused_or_computed_again_and_what_differs_is_said(
    place, command, part, monkeypatch
):
    said = f"{part} {identity()[part]} then, other now"
    later(monkeypatch, **{part: "other"})
    there = tables(place / command)
    code, output = do(place, command)
    assert said in " ".join(output.split())
    if command != "study":
        assert code == 2
        assert "--fresh" in output
        assert tables(place / command) == there
        return
    assert code == 0
    assert "every collision is computed again" in " ".join(output.split())
    summary = json.loads((place / "study" / "summary.json").read_text())
    assert summary["versions"][part] == "other"
    assert summary["changes"] == [f"{said}: every collision is computed again"]
    assert tables(place / "study") == there  # it is not another one, after all


def test_a_study_uses_nothing_that_another_identity_computed(place, monkeypatch):
    with monkeypatch.context() as patch:
        later(patch, numba="0.60.0")
        trainmj.run_study(place / "my.study.yaml", place / "study", figures=())
    back = trainmj.run_study(place / "my.study.yaml", place / "study", figures=())
    assert back.simulated == 8  # as it stands, 6 points, the check
    assert len(back.computed) == 9
    assert back.changes == (f"numba 0.60.0 then, {identity()['numba']} now: every collision is computed again",)


def test_what_has_changed_is_said_until_a_study_comes_to_its_end(place, monkeypatch):
    later(monkeypatch, numba="0.99.0")
    with monkeypatch.context() as patch:
        patch.setattr("trainmj.study.run.summary_of", lambda *_: pytest.fail("killed"))
        with pytest.raises(pytest.fail.Exception, match="killed"):
            trainmj.run_study(place / "my.study.yaml", place / "study", figures=())
    assert not (place / "study" / "summary.json").exists()  # a report must not mix the two
    again = trainmj.run_study(place / "my.study.yaml", place / "study", figures=())
    assert len(again.changes) == 1
    assert "0.99.0 now: every collision is computed again" in again.changes[0]
    assert trainmj.run_study(place / "my.study.yaml", place / "study", figures=()).changes == ()


def test_a_history_of_another_scenario_or_version_is_computed_again(place, monkeypatch):
    """A file of the right name is no reason to believe that it is of this case."""
    folder = place / "sweep"
    code, output = do(place, "sweep", "--histories", "0")
    assert code == 0, output
    kept = (folder / "case_0.nc").read_bytes()
    assert trainmj.load_result(folder / "case_0.nc").scenario.collision.speed_km_h == 9
    scenario = trainmj.load(place / "train.yaml")
    trainmj.run(scenario).save(place / "other.nc")  # 10 km/h
    own = scenario.with_values({"collision.speed_km_h": 9})
    with monkeypatch.context() as patch:
        later(patch, numba="0.60.0")
        trainmj.run(own).save(place / "older.nc")
    for foreign in ("other.nc", "older.nc"):
        shutil.copy(place / foreign, folder / "case_0.nc")
        assert do(place, "sweep", "--histories", "0")[0] == 0
        assert (folder / "case_0.nc").read_bytes() == kept


def test_a_history_that_another_sweep_left_is_made_again_even_if_its_database_is_gone(place):
    """Breaks if a folder has a case of one sweep beside the rows of another."""
    folder = place / "sweep"
    assert do(place, "sweep", "--histories", "0,2")[0] == 0
    of_other = {name: (folder / name).read_bytes() for name in ("case_0.nc", "case_2.nc")}
    train = place / "train.yaml"
    train.write_text(train.read_text().replace("mass_t: 30", "mass_t: 20"))
    for more in ((), ("--fresh",)):
        for name, content in (of_other | {"case_0.html": b"the report of a case"}).items():
            (folder / name).write_bytes(content)
        (folder / "results.sqlite").unlink()
        code, output = do(place, "sweep", *more)
        assert code == 0, output
        for number in (0, 2):
            history = trainmj.load_result(folder / f"case_{number}.nc")
            assert history.scenario.values()["trains"]["t"]["mass_t"] == 20
            assert history.scenario.collision.speed_km_h == 9 + number
        assert not (folder / "case_0.html").exists()


WORDED = {"title": "T", "notes": "N", "report": {"revision": "B"}, "sources": {"collision.speed_km_h": "measured: S"}}


@every_command
def test_a_new_cover_title_note_or_source_computes_nothing_again_and_is_in_the_new_report(place, command):
    """Breaks if the next revision of a report costs its results, or is printed with the old letter."""
    there = tables(place / command)
    with (place / "train.yaml").open("w", encoding="utf-8") as out:
        YAML().dump(WORDED | TRAIN, out)
    code, said = do(place, command, "--report")
    assert code == 0, said
    assert tables(place / command) == there
    again = {
        "sweep": "were there",
        "study": "0 collisions computed now, steps done now: none",
        "identify": "0 new trials",
    }
    assert again[command] in " ".join(said.split())
    page = (place / command / "report.html").read_text(encoding="utf-8")
    assert "<dt>Revision</dt><dd>B</dd>" in page


def test_a_misspelt_response_leaves_what_is_there_even_if_it_starts_over(place):
    there = tables(place / "sweep")
    code, output = do(place, "sweep", "--responses", "TS_m", "--fresh")
    assert code == 2
    assert "TS_m" in output
    assert tables(place / "sweep") == there


def test_a_changed_study_that_was_stopped_has_no_report(place):
    """Its tables would be of the one and its summary of the other."""
    with (place / "my.study.yaml").open("w", encoding="utf-8") as out:
        YAML().dump(STUDY | {"design": {"kind": "sobol", "n": 7, "seed": 1}}, out)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("trainmj.study.run.summary_of", lambda *_: pytest.fail("killed"))
        with pytest.raises(pytest.fail.Exception, match="killed"):
            trainmj.run_study(place / "my.study.yaml", place / "study", figures=())
    refused = CliRunner().invoke(main, ["report", str(place / "study")])
    assert refused.exit_code == 2
    assert "not finished" in refused.output
    assert do(place, "study")[0] == 0
    assert CliRunner().invoke(main, ["report", str(place / "study")]).exit_code == 0


@pytest.mark.parametrize("command", ["study", "identify"])
def test_a_summary_that_cannot_be_removed_is_said(place, command):
    (place / command / "summary.json").unlink()
    (place / command / "summary.json").mkdir()
    code, output = do(place, command)
    assert code == 2
    assert "summary.json: cannot be removed or replaced (is a folder)" in " ".join(output.split())


def test_an_edited_law_of_the_same_version_has_another_hash(tmp_path):
    """Any module that numbers come from, at any depth; not one that only shows them."""
    source = Path(identities.__file__).parents[1]

    def hashed(name, edit):
        folder = tmp_path / name
        shutil.copytree(source, folder, ignore=shutil.ignore_patterns("__pycache__"))
        edit(folder)
        spec = importlib.util.spec_from_file_location(f"identity_{name}", folder / "collision" / "identity.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.identity()["law"]

    def swap(folder):
        one, other = (folder / "collision" / "law" / "crush.py", folder / "collision" / "device.py")
        texts = one.read_text(), other.read_text()
        other.write_text(texts[0])
        one.write_text(texts[1])

    def edit(*path):
        def append(folder):
            file = folder.joinpath(*path)
            file.write_text(file.read_text() + "\n")

        return append

    same = hashed("same", lambda folder: None)
    assert same == identity()["law"] == hashed("shown", edit("single", "screen.py"))
    law, units, design = edit("collision", "law", "crush.py"), edit("units.py"), edit("doe", "designs.py")
    others = {hashed(str(n), change) for n, change in enumerate((law, units, design, swap))}
    assert len({same, *others}) == 5


@every_command
def test_the_same_command_again_computes_nothing_and_leaves_the_same(place, command, monkeypatch):
    there = tables(place / command)
    monkeypatch.setattr("trainmj.cases.runner.fill", lambda *_: pytest.fail("a case is computed again"))
    code, said = do(place, command)
    assert code == 0, said
    assert tables(place / command) == there


@every_command
def test_another_scenario_is_refused_or_what_depends_on_it_is_done_again(place, command):
    text = (place / "train.yaml").read_text()
    (place / "train.yaml").write_text(text.replace("mass_t: 30", "mass_t: 33"))
    there = tables(place / command)
    code, output = do(place, command)
    assert "trains.t.mass_t 30 then, 33 now" in " ".join(output.split())
    assert code == (0 if command == "study" else 2)
    assert (tables(place / command) == there) == (command != "study")
    if command == "study":
        (place / "train.yaml").write_text(text)
        back = trainmj.run_study(place / "my.study.yaml", place / "study", figures=())
        assert back.simulated == 0
        assert back.changes == ("trains.t.mass_t 33 then, 30 now",)
        assert tables(place / command) == there


def test_another_design_of_a_study_is_said_and_only_what_depends_on_it_is_done_again(place):
    file = place / "my.study.yaml"
    file.write_text(file.read_text().replace("n: 6", "n: 7"))
    again = trainmj.run_study(file, place / "study", figures=())
    assert again.changes == ("design.n 6 then, 7 now",)
    assert 1 <= again.simulated <= 2  # the seventh point; the check, if another design is chosen
    assert "as it stands" not in again.computed


@every_command
def test_fresh_takes_away_what_the_command_left_and_nothing_else(place, command):
    folder = place / command
    there = tables(folder)
    left = {file.name for file in folder.iterdir()}
    (folder / "notes.txt").write_text("mine")
    train = place / "train.yaml"
    train.write_text(train.read_text().replace("mass_t: 30", "mass_t: 33"))
    code, said = do(place, command, "--fresh")
    assert code == 0, said
    assert " then, " not in said
    assert {file.name for file in folder.iterdir()} == left | {"notes.txt"}
    assert tables(folder) != there
    train.write_text(train.read_text().replace("mass_t: 33", "mass_t: 30"))
    assert do(place, command, "--fresh")[0] == 0
    assert tables(folder) == there


@every_command
def test_fresh_starts_over_from_a_damaged_store(place, command):
    there = tables(place / command)
    (place / command / STORES[command]).write_bytes(b"no database" * 500)
    code, said = do(place, command)
    assert code == 2
    assert "is damaged or no SQLite file" in said
    assert "--fresh" in said
    code, said = do(place, command, "--fresh")
    assert code == 0, said
    assert tables(place / command) == there


@every_command
def test_a_store_that_is_a_link_is_not_followed(place, command):
    victim = (place / command / STORES[command]).rename(place / "victim.sqlite")
    before = victim.read_bytes()
    (place / command / STORES[command]).symlink_to(victim)
    code, said = do(place, command)
    assert code == 2
    assert "is a link to another file" in said
    assert do(place, command, "--fresh")[0] == 0
    assert victim.read_bytes() == before


@every_command
def test_a_folder_that_somebody_writes_to_is_not_started_over(place, command):
    there = {file: file.read_bytes() for file in (place / command).iterdir()}
    with held(place / command):
        code, said = do(place, command, "--fresh")
    assert code == 2
    assert "another trainmj is writing" in said
    assert {file: file.read_bytes() for file in (place / command).iterdir()} == there


def report(folder):
    """Exit code and output of trainmj report."""
    done = CliRunner().invoke(main, ["report", str(folder)])
    assert "Traceback" not in done.output
    return done.exit_code, done.output


@pytest.mark.parametrize("command", ["sweep", "study"])
def test_a_report_beside_a_running_writer_has_what_is_there_or_a_clear_word(place, command):
    folder = place / command
    with held(folder):
        assert report(folder)[0] == 0
        if command == "sweep":
            with closing(sqlite3.connect(folder / "results.sqlite")) as db, db:
                db.execute("DELETE FROM results")
                signed(db)
        else:
            (folder / "summary.json").unlink()
        code, said = report(folder)
    assert code == 2
    assert "another trainmj is writing to this folder: wait for it" in said
    code, said = report(folder)
    assert code == 2
    assert "goes on" in said
    assert "damaged" not in said


@pytest.mark.parametrize("fresh", [(), ("--fresh",)])
@every_command
def test_an_interruption_says_how_to_go_on_and_keeps_what_was_finished(place, command, fresh, monkeypatch):
    from trainmj.cases.engine import Local

    compute = Local.__call__
    for file in (place / command).iterdir():
        file.unlink()
    finished = []

    def stopping(self, cases):
        for case in each_alone(compute(self, cases)):
            if len(finished) == (4 if command == "identify" else 2):  # identify tries its start values first
                raise KeyboardInterrupt
            finished.append(case)
            yield case

    with monkeypatch.context() as patch:
        patch.setattr(Local, "__call__", stopping)
        code, said = do(place, command, *fresh)
    assert code == 130
    same = "the same command without --fresh" if fresh else "the same command"
    assert said.endswith(f"Stopped. What was finished is in {command}; {same} goes on.\n")
    again = []
    monkeypatch.setattr(Local, "__call__", lambda self, cases: _noted(each_alone(compute(self, cases)), again))
    assert do(place, command)[0] == 0
    kept = finished[2:] if command == "identify" else finished
    assert not {case.keys[0] for case in kept} & {case.keys[0] for case in again}


def _noted(cases, seen):
    for case in cases:
        seen.append(case)
        yield case


@pytest.mark.parametrize("name", ["../victim.txt", "sub/victim.txt", "/etc/hostname"])
def test_a_study_removes_nothing_outside_its_folder_whatever_the_folder_says(place, name):
    victim = place / "victim.txt"
    victim.write_text("precious")
    state = place / "study" / "steps.json"
    steps = unsealed(state.read_bytes())
    steps["design"]["files"][name] = sha256(b"precious").hexdigest()
    state.write_text(json.dumps(sealed(steps)))
    for more in ((), ("--fresh",)):
        code, said = do(place, "study", *more)
        assert code == 2
        assert "which is not a plain name" in said
    assert victim.read_text() == "precious"


@pytest.mark.parametrize("command", ["study", "identify"])
def test_a_response_that_cannot_be_a_number_is_refused_before_anything_runs(tmp_path, command):
    inputs(tmp_path)
    for name, response in (("my.study.yaml", "peak_device_M1_g"), ("my.targets.yaml", "stroke_M1_wall_mm")):
        file = tmp_path / name
        file.write_text(file.read_text().replace(response, "cfc60_peak_M1_g"))
    train = tmp_path / "train.yaml"
    train.write_text(train.read_text().replace("step_ms: 0.1", "step_ms: 0.1\n  record_every_ms: 5"))
    code, said = do(tmp_path, command)
    assert code == 2
    assert "is not a number with simulation.record_every_ms = 5" in said
    assert "take at most 1.6" in said
    assert not (tmp_path / command).exists()


def test_a_study_of_trains_too_long_for_the_store_keeps_its_own_responses(place):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("trainmj.study.simulator.MOST_COLUMNS", 10)
        short = trainmj.run_study(place / "my.study.yaml", place / "narrow", figures=())
        assert trainmj.run_study(place / "my.study.yaml", place / "narrow", figures=()).simulated == 0
    assert short.simulated == 7  # 6 points and the check
    assert tables(place / "narrow") == tables(place / "study")
    with closing(sqlite3.connect(place / "narrow" / "simulations.sqlite")) as db:
        assert len(db.execute("PRAGMA table_info(results)").fetchall()) == 5  # key, status, reason, two responses
