"""What a newcomer does first: a scenario of their own, files checked, words completed, something that moves."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import openpyxl
import pytest
from click.shell_completion import BashComplete
from click.testing import CliRunner
from pages import blocks, read

import trainmj
from trainmj.cli import main
from trainmj.cli.completing import RESULTS, SHELLS
from trainmj.cli.report import kinds
from trainmj.output import waiting
from trainmj.scenario import shipped

DEVICES = {
    "head device": [("Stroke [mm]", "Force [kN]"), (0, 0), (40, 700), (45, 900), (450, 1100)],
    "joint": [("Stroke [m]", "Force [N]"), (0, 0), (0.02, 600_000), (0.3, 650_000)],
    "cars": [("name", "mass_t", "length_m"), ("A", 38, 22), ("B", 30, 20)],
}


def command(*words: object, code: int = 0, answers: str | None = None) -> str:
    done = CliRunner().invoke(main, list(map(str, words)), input=answers)
    assert done.exit_code == code, done.output
    return done.output


def workbook(file: Path, **sheets: object) -> Path:
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in (DEVICES | sheets).items():
        sheet = book.create_sheet(name)
        for row in rows or ():
            sheet.append(row)
    book.save(file)
    return file


# new


def test_a_new_scenario_runs_at_once_and_passes_check(tmp_path):
    """Breaks if the first file of a newcomer is refused, or its first run shows a passed limit."""
    said = command("new", tmp_path / "my train.yaml", "--yes")
    words = f"trainmj check '{tmp_path}/my train.yaml'", f"trainmj run '{tmp_path}/my train.yaml' --out 'my train'"
    assert all(word in said for word in words)
    assert "4 vehicles, 132 t" in command("check", tmp_path / "my train.yaml")
    summary = trainmj.summarise(trainmj.run(tmp_path / "my train.yaml", {"simulation.step_ms": 0.25}))
    assert summary.status.kind == "over"
    assert all(limit.kept for limit in summary.limits)
    assert not any("rises faster" in remark for remark in summary.remarks)


def test_a_new_scenario_has_the_values_of_its_options_and_says_what_each_is(tmp_path):
    file = tmp_path / "a.yaml"
    options = "--vehicles 3 --mass-t 40 --length-m 25 --front-force-kn 1500 --front-stroke-mm 700"
    options += " --coupler-force-kn 900 --coupler-stroke-mm 300 --speed-km-h 15 --partner wagon_80t"
    command("new", file, *options.split())
    scenario = trainmj.load(file)
    assert scenario.under_test == "train (3 vehicles, 120 t)"
    assert scenario.collision.speed_km_h == 15
    assert scenario.collision.partner == "wagon_80t"
    assert [scenario.devices[name].stroke_limit_mm for name in ("front", "coupler")] == [700, 300]
    assert scenario.locate("devices.front.curve.force_kN")[0][-1] == 1500
    assert scenario.with_values(mass_t=41, speed_km_h=16).under_test == "train (3 vehicles, 123 t)"
    assert file.read_text().count("#") > 8


def test_a_new_scenario_from_tables_has_their_curves_and_vehicles(tmp_path):
    """Breaks if units of heads are lost, or the devices change places."""
    said = command("new", tmp_path / "own.yaml", "--from", workbook(tmp_path / "devices.xlsx"))
    assert "head_device is at the ends of the train, joint between its vehicles." in said
    chain = trainmj.line_up(tmp_path / "own.yaml")
    assert [v.mass for v in chain.vehicles] == [30e3, 38e3, 38e3, 30e3]
    scenario = trainmj.load(tmp_path / "own.yaml")
    assert scenario.locate("devices.joint.curve.force_kN")[0][-1] == pytest.approx(650)
    assert scenario.locate("devices.head_device.curve.stroke_mm")[0][-1] == 450
    assert "parameters" not in scenario.parameters
    (tmp_path / "head.csv").write_text("stroke_mm,force_kN\n0,0\n50,900\n400,900\n")
    command("new", tmp_path / "b.yaml", "--from", tmp_path / "head.csv", "--vehicles", 1, "--partner", "rigid_wall")
    assert trainmj.load(tmp_path / "b.yaml").devices["head"].stroke_limit_mm == 400
    command(*["new", tmp_path / "c.yaml", "--from", tmp_path / "devices.xlsx", "--front", "joint", "--yes"])
    assert trainmj.load(tmp_path / "c.yaml").trains["train"].front == "joint"


def test_a_sheet_without_a_telling_name_takes_the_place_that_is_left(tmp_path):
    """Breaks if one curve is at both places while there are two, or one that is not used is not named."""
    curve = [("Stroke [mm]", "Force [kN]"), (0, 0), (40, 600), (350, 1000)]
    sheets = {"head device": curve, "joint": None, "cars": None, "Zwischenkupplung": curve, "Pendel": curve}
    book = openpyxl.load_workbook(workbook(tmp_path / "d.xlsx", **sheets))
    del book["joint"], book["cars"]
    book.save(tmp_path / "d.xlsx")
    said = command("new", tmp_path / "own.yaml", "--from", tmp_path / "d.xlsx", "--yes")
    assert "head_device is at the ends of the train, Zwischenkupplung between its vehicles." in said
    assert "Pendel: not used; --front NAME and --between NAME take another one." in said
    assert "rises faster" not in command("check", tmp_path / "own.yaml")  # the car body is as steep as they unload
    book["Pendel"]["B3"] = "600"
    book.save(tmp_path / "d.xlsx")
    assert "d.xlsx: Pendel!B3: Force [kN] = '600': is text" in command(
        "new", tmp_path / "b.yaml", "--from", tmp_path / "d.xlsx", code=2
    )


def test_new_asks_on_a_terminal_for_what_no_option_states(tmp_path, monkeypatch):
    """Breaks if an answer goes to another question."""
    monkeypatch.setattr(sys.modules["trainmj.cli.new"], "is_asked", lambda yes: not yes)
    said = command("new", tmp_path / "a.yaml", "--mass-t", 30, answers="2\n\n1200\n\n\n\n12\nrigid_wall\n")
    assert "Mass of each" not in said
    scenario = trainmj.load(tmp_path / "a.yaml")
    assert scenario.subject == "train (2 vehicles, 60 t) at 12 km/h into a rigid wall"
    assert scenario.locate("devices.front.curve.force_kN")[0][-1] == 1200


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("there.yaml", "there.yaml: is there already: give another name, or remove it"),
        ("a.txt", "a.txt: must end in .yaml"),
        ("no/a.yaml", "no/a.yaml: cannot be written .No such file or directory"),
        ("a.yaml --partner wagon", "nothing is written: .*did you mean 'wagon_80t'"),
        ("a.yaml --vehicles 0", "0 is not in the range"),
        ("a.yaml --front head", "name a table of --from, which is not given"),
        (
            "a.yaml --from devices.xlsx --front hed",
            "hed: no table with a curve has this name; known: head_device, joint",
        ),
        ("a.yaml --from devices.xlsx --vehicles 3", "--vehicles: is in the tables of --from: leave it out"),
        ("a.yaml --from nosuch.xlsx", "nosuch.xlsx: there is no such file"),
        ("a.yaml --from other.xlsx", "other.xlsx, odd: is neither a curve, .* nor vehicles, .* its columns are 'a, b'"),
        ("a.yaml --from cars.csv", "cars.csv: has no curve"),
        ("below/a.yaml --from devices.xlsx", "is not in the folder of the scenario .below. or below it: copy it there"),
    ],
)
def test_new_writes_nothing_where_it_cannot_be_right(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "below").mkdir()
    (tmp_path / "there.yaml").write_text("mine")
    (tmp_path / "cars.csv").write_text("name,mass_t\nA,30\n")
    workbook(tmp_path / "devices.xlsx")
    workbook(tmp_path / "other.xlsx", odd=[("a", "b"), (1, 2), (3, 4)])
    before = sorted(tmp_path.rglob("*"))
    assert re.search(said, command("new", *words.split(), code=2))
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "there.yaml").read_text() == "mine"


# check


def test_check_tells_what_tables_and_results_hold(tmp_path, monkeypatch):
    """Breaks if check calls a right file wrong because it is no scenario."""
    monkeypatch.chdir(tmp_path)
    said = command("check", workbook(tmp_path / "devices.xlsx"))
    assert (
        "a curve of 4 points up to 450 mm and 1100 kN; named by curve: {file: devices.xlsx, sheet: head device}" in said
    )
    assert "2 vehicles; named by vehicles: {file: devices.xlsx, sheet: cars}" in said
    (tmp_path / "cases.csv").write_text("mass_t,speed_km_h\n30,20\n33,20\n")
    assert "2 rows of mass_t, speed_km_h" in command("check", "cases.csv")
    (tmp_path / "bad.csv").write_text("stroke_mm,force_kN\n0,0\n5,x\n")
    assert "row 2: force_kN = 'x'" in command("check", "bad.csv", code=2)
    trainmj.run("b_type", {"simulation.time_limit_s": 0.02}).save(tmp_path / "result.nc")
    for file in (".", "result.nc"):
        assert "is a saved result, whole" in command("check", file)
        assert "Status: time limit" in command("check", file)
    content = bytearray((tmp_path / "result.nc").read_bytes())
    content[-9] ^= 1
    (tmp_path / "case_1.nc").write_bytes(content)
    assert "case_1.nc" in command("check", "case_1.nc", code=2)
    for kind in kinds()[1:]:
        folder = tmp_path / kind.file.replace(".", "_")
        folder.mkdir()
        (folder / kind.file).touch()
        assert f"holds {kind.name}" in command("check", folder)


def test_check_refuses_tables_by_file_and_as_a_scenario_would(tmp_path, monkeypatch):
    """Breaks if check accepts what no device can have, or a message does not say which file is wrong."""
    monkeypatch.chdir(tmp_path)
    wrong = {
        "down.csv": ("stroke_mm,force_kN\n0,0\n-40,600\n", "no device can have this curve"),
        "no_heads.csv": ("0,0\n40,600\n", "begins with numbers: it must have a line of heads"),
        "text.csv": ("stroke_mm,force_kN\n0,0\n40,x\n", "force_kN = 'x': must be a number"),
        "sum.csv": ("name,mass_t\nA,30\nTotal,30\n", "is a sum or a mean, not a vehicle"),
        "none.xlsx": ("stroke_mm", "has the name of a workbook, but is none"),
        "none.k": ("*KEYWORD\n", "is a keyword file without"),
    }
    for name, (text, said) in wrong.items():
        (tmp_path / name).write_text(text)
        found = command("check", name, code=2)
        assert name in found
        assert said in found
    openpyxl.Workbook().save("empty.xlsx")
    assert "empty.xlsx: has no table on a sheet that is shown" in command("check", "empty.xlsx", code=2)
    (tmp_path / "c.k").write_text("*DEFINE_CURVE\n101\n0,0\n40,600\n")
    assert "curve 101 of 2 points; named by curve: {file: c.k, id: 101}" in command("check", "c.k")
    assert "allowed folder '': there is no such folder" in command("check", "b_type", "--allow-folder", "", code=2)


def test_help_of_check_names_every_kind_of_file():
    said = " ".join(command("check", "--help").split())
    for kind in (
        "scenario",
        "sweep",
        "study",
        "targets",
        "assessment",
        "reliability",
        "partner",
        ".csv",
        ".xlsx",
        ".nc",
    ):
        assert kind in said


# completion


def completed(line: str) -> list[str]:
    """What bash is offered at the end of a line."""
    *before, begun = line.split(" ")[1:]
    items = BashComplete(main, {}, "trainmj", "_TRAINMJ_COMPLETE").get_completions(before, begun)
    return [item.value for item in items if item.type == "plain"]


@pytest.mark.parametrize(
    ("line", "there", "not_there"),
    [
        ("trainmj ren", ["render"], ["run"]),
        ("trainmj run b_type_v", ["b_type_vertical"], ["b_type_vertical.sweep.yaml"]),
        ("trainmj study b_", ["b_type", "b_type_robust"], ["b_type_vertical"]),
        ("trainmj identify ", ["b_type", "fra_cem"], ["en15227"]),
        ("trainmj reliability b_type_as", ["b_type_as_built.reliability.yaml"], []),
        ("trainmj assess en15227_c1 --standard ", ["en15227", "cfr238-tier1"], ["en15227_c1"]),
        ("trainmj sweep beyond", ["beyond_masses.sweep.yaml"], []),
        ("trainmj check wag", ["wagon_80t", "wagon_80t.partner.yaml"], []),
        ("trainmj run b_type --set ", ["mass_t=33", "speed_km_h=25", "collision.rail_friction=0.008"], []),
        ("trainmj run b_type_wall --set sp", ["speed_km_h=12.5"], ["mass_t=33"]),
        ("trainmj sweep b_type --out x --vary devices.front.sti", ["devices.front.stiffness_kN_per_mm=1000"], []),
        ("trainmj reliability b_type_as_built --set ma", ["mass_t=33"], []),
        ("trainmj check nosuch --set ", [], ["mass_t=33"]),
        ("trainmj new a.yaml --partner w", ["wagon_80t"], ["b_type"]),
        ("trainmj report ", ["mine"], ["other"]),
        ("trainmj run m", ["mine"], ["other"]),
    ],
)
def test_a_shell_completes_what_the_command_takes(line, there, not_there, tmp_path, monkeypatch):
    """Breaks if the names of a command are those of another, or a path is that of another scenario."""
    monkeypatch.chdir(tmp_path)
    for folder, file in (("mine", "result.nc"), ("other", "notes.txt")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / file).touch()
    found = completed(line)
    assert set(there) <= set(found), found
    assert not set(not_there) & set(found)


@pytest.mark.parametrize("name", [name for name in shipped() if "fra" not in name])
def test_every_path_that_is_offered_leads_to_the_value_beside_it(name):
    """Breaks if a shell offers what --set then refuses."""
    scenario = trainmj.load(name)
    offered = completed(f"trainmj run {name} --set ")
    assert len(offered) > 10
    for path, _, value in (text.partition("=") for text in offered):
        (found, *_) = scenario.locate(path)
        assert value in ("", str(found), str(found).lower(), f"{found:g}" if isinstance(found, float) else ""), path


def test_folders_of_results_are_known_by_the_files_that_reports_are_made_of():
    assert set(RESULTS) == {kind.file for kind in kinds() if kind.page}


@pytest.mark.parametrize("shell", SHELLS)
def test_what_a_shell_needs_to_complete_is_printed(shell):
    assert f"_TRAINMJ_COMPLETE={shell}_complete" in command("completion", shell)


def test_completion_imports_nothing_heavy(python):
    """Breaks if every press of the tabulator key waits for an engine."""
    code = (
        "import sys\nfrom trainmj.cli import main\nfrom click.shell_completion import BashComplete as B\n"
        "print(len(B(main, {}, '', '').get_completions(['run', 'b_type', '--set'], '')))\n"
        "print(*{'numba', 'mujoco', 'numpy', 'pydantic', 'rich', 'pandas'} & set(sys.modules))"
    )
    done = python("-c", code)
    count, *heavy = done.stdout.split()
    assert int(count) > 10, done.stderr
    assert not heavy


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="counts the processor time of child processes")
def test_help_and_completion_answer_at_once():
    """Breaks if help takes more than 0.15 s of the processor, or a completion more than 0.3 s; the best of five."""
    import resource

    script = Path(sys.executable).with_name("trainmj")

    def spent(*words: str, **env: str) -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([script, *words], env=os.environ | env, capture_output=True, check=False)
        now = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert done.stdout
        return now.ru_utime - before.ru_utime + now.ru_stime - before.ru_stime

    line = {"_TRAINMJ_COMPLETE": "bash_complete", "COMP_WORDS": "trainmj run b_type --set ", "COMP_CWORD": "4"}
    assert min(spent("--help") for _ in range(5)) <= 0.15
    assert min(spent(**line) for _ in range(5)) <= 0.3


# something moves


class Terminal:
    """An error stream that is a terminal, in memory."""

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None:
        pass

    def isatty(self) -> bool:
        return True


LONG = [
    "run b_type",
    "check b_type",
    "scenarios",
    "sweep b_type --vary mass_t=30,33 --out x",
    "study b_type --out x",
    "identify b_type --out x",
    "assess b_type --standard en15227",
    "reliability b_type_as_built --out x",
    "compare a b",
    "report x",
    "explore b_type",
    "render b_type --out x.png",
    "export b_type",
    "verify",
    "paper",
]


@pytest.mark.parametrize("command", LONG)
def test_every_long_command_waits_visibly_before_all_else(monkeypatch, command):
    """Breaks if a terminal stays still while a command imports, reads or computes."""

    class Moves(Exception):
        pass

    def begin(name):
        raise Moves(name)

    monkeypatch.setattr(waiting, "waiting", begin)
    with pytest.raises(Moves, match=f"^{command.split()[0]}$"):
        main.main(command.split(), standalone_mode=False)


def test_a_line_moves_on_a_terminal_and_nowhere_else(monkeypatch, capfd):
    terminal = Terminal()
    with waiting.waiting("paper"):
        waiting.tell("unseen")
    assert capfd.readouterr() == ("", "")
    monkeypatch.setattr("sys.stderr", terminal)
    with waiting.waiting("paper"):
        waiting.tell("verify: closed forms")
        before = terminal.text
        assert "paper" in before
        waiting.hush()
        assert len(terminal.text) > len(before)  # it is wiped away
        before = terminal.text
        waiting.tell("late")
    assert terminal.text == before


def test_every_command_that_may_take_long_shows_a_line_at_once(monkeypatch):
    """Breaks if a command computes, or only imports, before anything moves."""
    shown: list[str] = []

    class Reached(Exception):
        pass

    def begin(text: str) -> None:
        shown.append(text)
        raise Reached

    monkeypatch.setattr(waiting, "waiting", begin)
    words = {
        "run": ["b_type"], "sweep": ["b_type", "--out", "x"], "study": ["b_type", "--out", "x"],
        "identify": ["b_type", "--out", "x"], "assess": ["b_type", "--standard", "en15227"],
        "reliability": ["b_type", "--out", "x"], "report": ["x"], "render": ["b_type", "--out", "x.png"], "verify": [],
        "paper": [], "compare": ["b_type", "b_type"],
    }  # fmt: skip
    for name, rest in words.items():
        done = CliRunner().invoke(main, [name, *rest])
        assert isinstance(done.exception, Reached), done.output
    assert shown == list(words)


# the page


def test_the_tasks_of_the_page_take_five_commands_at_most():
    sections = read("docs/first-hour.md").split("\n## ")[1:]
    for section in sections:
        assert len(re.findall(r"^trainmj ", section, flags=re.MULTILINE)) <= 5, section.partition("\n")[0]


@pytest.mark.thorough
def test_the_numbers_of_the_page_are_those_of_its_commands(tmp_path, monkeypatch):
    """Breaks if the page tells other ranges than the sweep prints."""
    monkeypatch.chdir(tmp_path)
    printed = ""
    for words in (words for block in blocks("docs/first-hour.md") for words in block.commands):
        if words[0] == "sweep":
            printed += command(*words)
    rows = {" ".join(line.split()) for line in printed.splitlines()}
    told = [b.text for b in blocks("docs/first-hour.md") if b.language == "text" and "TAMA_g, of" in b.text]
    assert len(told) == 2
    for line in "".join(told).splitlines():
        assert " ".join(line.split()) in rows


def test_a_failure_is_red_on_a_terminal_unless_colours_are_off(monkeypatch):
    from trainmj.output.console import new_console, print_table
    from trainmj.output.table import Table, failed, worded

    table = Table(worded("Check"), [(failed(),)])
    for colour, code in (("", "\x1b[1;31mFAIL"), ("1", "\x1b[1mFAIL")):
        monkeypatch.setenv("FORCE_COLOR", "1")
        monkeypatch.setenv("TERM", "xterm-256color")
        monkeypatch.setenv("NO_COLOR", colour)
        console = new_console()
        with console.capture() as got:
            print_table(console, table)
        assert code in got.get()
    for name in ("FORCE_COLOR", "NO_COLOR"):
        monkeypatch.delenv(name)
    console = new_console()
    with console.capture() as got:
        print_table(console, table)
    assert "\x1b" not in got.get()
    assert console.width == 80
