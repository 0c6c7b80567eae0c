"""Nothing in a file can become a program, a command to a terminal, or markup in what trainmj writes."""

from __future__ import annotations

import ast
import csv
import re
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import pytest
from kinds import BASE, KINDS, TUBE, command
from mutations import document, good

import trainmj
from trainmj.errors import InputError
from trainmj.files.text import HIDDEN
from trainmj.files.yaml import read_value

PACKAGE = Path(trainmj.__file__).parent
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "read_pickle", "to_pickle", "unsafe_load", "full_load"}
FORBIDDEN_MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "yaml"}
OWN_COMPILE = {"kernel.py", "model.py", "offsets.py"}  # re.compile, and MuJoCo's own compile() of a model


@cache
def _trees() -> list[tuple[Path, ast.AST]]:
    return [(path, ast.parse(path.read_text(encoding="utf-8"))) for path in sorted(PACKAGE.rglob("*.py"))]


@pytest.mark.thorough
def test_no_code_comes_from_data() -> None:
    found = []
    for path, tree in _trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FORBIDDEN_CALLS:
                found.append(f"{path.name}:{node.lineno}: {node.func.id}")
            attribute = node.func.attr if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) else ""
            if attribute in FORBIDDEN_CALLS - {"compile", "eval", "exec"}:
                found.append(f"{path.name}:{node.lineno}: .{attribute}")
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found += [f"{path.name}:{node.lineno}: {n}" for n in names if n.partition(".")[0] in FORBIDDEN_MODULES]
            if isinstance(node, ast.keyword) and node.arg in ("allow_pickle", "shell"):
                assert isinstance(node.value, ast.Constant)
                assert node.value.value is False, f"{path.name}:{node.value.lineno}: {node.arg}"
    assert not found


def test_yaml_is_read_in_one_place_without_constructors() -> None:
    texts = {path.name: path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}
    assert {name for name, text in texts.items() if re.search(r"(from|import) ruamel", text)} == {"yaml.py"}
    text = "".join(texts.values())
    assert set(re.findall(r"YAML\(([^)]*)\)", text)) == {'typ="safe", pure=True'}
    assert not re.search(r"yaml\.load|YAML\([^)]*\)\.load", text)


@pytest.mark.parametrize(
    "tag",
    ["!!python/object/apply:os.system ['touch owned']", "!!python/name:os.system", "!mine {a: 1}", "!!binary aA=="],
)
def test_tags_are_refused_with_place_and_name(tag: str) -> None:
    with pytest.raises(InputError, match=r"scenario:2:1: title: must be .* not a YAML"):
        trainmj.scenario.from_yaml(f"notes: x\ntitle: {tag}\n")


HOSTILE = "[red]$\\frac{$ <script>alert(1)</script> --> ]]> &lt; \"' ; DROP TABLE results; -- {0} %s [/nope] =1+1"


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A scenario with a title that means something to all that shows it."""
    (tmp_path / "tube.csv").write_bytes(TUBE)
    file = tmp_path / "my.yaml"
    file.write_text(document(BASE | {"title": HOSTILE, "notes": HOSTILE}), encoding="utf-8")
    return file


def test_a_title_is_text_wherever_it_is_shown(hostile: Path, tmp_path: Path) -> None:
    code, output = command("run", hostile, "--out", tmp_path / "out")
    assert code == 0, output
    assert "".join(HOSTILE.split()) in "".join(output.split()), "printed as it is, not as markup"
    assert trainmj.load(tmp_path / "out" / "scenario.yaml").title == HOSTILE
    assert trainmj.load_result(tmp_path / "out" / "result.nc").scenario.title == HOSTILE
    code, output = command("export", hostile, "--out", tmp_path / "model.xml")
    assert code == 0, output
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml")).nv == 2


def test_a_title_is_text_in_a_report(hostile: Path, tmp_path: Path) -> None:
    code, output = command("run", hostile, "--out", tmp_path / "out", "--figures", "none", "--report")
    assert code == 0, output
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<script>alert(1)" not in page
    assert "&lt;script&gt;alert(1)" in page


@pytest.mark.parametrize(
    "title",
    [
        "\\u200f",
        "\\u200e",
        "\\u061c",
        "\\e[2J",
        "\\x07",
        "\\0",
        "\\r",
        "\\x9b31m",
        "\\u202e",
        "\\u2028",
        "\\uffff",
        "\\ud800",
        "\\x7f",
    ],
)
def test_characters_that_steer_a_terminal_are_refused_and_written_out(title: str, tmp_path: Path) -> None:
    file = tmp_path / "my.yaml"
    file.write_text(f'builds_on: b_type\ntitle: "a{title}b"\n')
    for what in (("check", file), ("check", "b_type", "--set", f'title="a{title}b"')):
        code, output = command(*what)
        assert code == 2
        assert "printable" in output or "not valid YAML" in output
        assert not HIDDEN.search(output)


def test_a_file_name_cannot_steer_a_terminal(tmp_path: Path) -> None:
    file = tmp_path / "a\x1b[2Jb.yaml"
    file.write_text("nothing: 1\n")
    code, output = command("check", file)
    assert code == 2
    assert "\\x1b[2J" in output
    assert not HIDDEN.search(output)


@pytest.mark.parametrize("title", ["b_type\\nStatus: over", "a\\tb"])
def test_a_title_is_one_line(title: str, tmp_path: Path) -> None:
    """Breaks if a title can say what the line below it says."""
    for name, text in (("my.yaml", "builds_on: b_type"), ("my.study.yaml", "scenario: b_type")):
        (tmp_path / name).write_text(f'{text}\ntitle: "{title}"\n')
        code, output = command("check", tmp_path / name)
        assert code == 2
        assert "must be one line of text" in output


@pytest.mark.parametrize("text", ["Run #2", "#2", "[1, 2] # two"])
def test_what_yaml_takes_for_a_comment_is_not_lost_from_a_change(text: str) -> None:
    code, output = command("check", "b_type", "--set", f"title={text}")
    assert code == 2
    assert "what follows # is a comment in YAML" in output
    assert read_value(f'"{text}"', "--set") == text


@pytest.mark.parametrize(
    "value",
    ["=1+1", "+1+1", "-x", "@SUM(A1)", "\t=1+1", " =1", "\u00a0=1", "\uff1d1", "\uff0b1", "\uff20SUM", "\ufe661"],
)
def test_a_formula_never_reaches_a_table(value: str, tmp_path: Path) -> None:
    file = tmp_path / "my.sweep.yaml"
    file.write_text(document({"scenario": "b_type", "vary": {"title": ["plain", value]}}))
    code, output = command("sweep", file, "--out", tmp_path / "out")
    assert code == 2
    assert "formula" in output


def test_no_cell_of_a_sweep_is_a_formula(tmp_path: Path) -> None:
    """Reasons quote what a user wrote."""
    file = tmp_path / "my.sweep.yaml"
    values: dict[str, Any] = {"scenario": "b_type_wall", "vary": {"collision.partner": ["x=1+1", "rigid_wall"]}}
    file.write_text(document(values | {"set": {"simulation.step_ms": 0.5, "simulation.time_limit_s": 0.02}}))
    code, output = command("sweep", file, "--out", tmp_path / "out", "--threads", "1")
    assert code == 0, output
    with (tmp_path / "out" / "results.csv").open(newline="", encoding="utf-8") as lines:
        cells = [cell for row in csv.reader(lines) for cell in row]
    assert "x=1+1" in cells
    assert not [c for c in cells if c.startswith(("=", "@", "\t")) or re.match(r"[+-][^0-9.]", c)]


@pytest.mark.parametrize("name", ["../tube.csv", "/etc/passwd", "link.csv", "sub/../../tube.csv", "a\\0b", "x" * 300])
@pytest.mark.parametrize("where", ["curve", "builds_on", "scenario", "cases", "design"])
def test_a_file_names_no_file_outside_its_folder(where: str, name: str, tmp_path: Path) -> None:
    inside = tmp_path / "in"
    (inside / "sub").mkdir(parents=True)
    (tmp_path / "tube.csv").write_bytes(TUBE)
    (inside / "link.csv").symlink_to("../tube.csv")
    file = inside / "my.yaml"
    text = {
        "curve": f'builds_on: b_type\ncurves: {{buffer: {{file: "{name}"}}}}\n',
        "builds_on": f'builds_on: "{name}"\n',
        "scenario": f'scenario: "{name}"\nvary: {{mass_t: [30]}}\n',
        "cases": f'scenario: b_type\ncases: "{name}"\n',
        "design": f"scenario: b_type\nfactors: {{M: {{sets: mass_t, bounds: [30, 36]}}}}\nresponses: {{TS: TS_mm}}\n"
        f'design: {{kind: table, file: "{name}"}}\nobjectives: {{TS: minimise}}\n',
    }[where]
    file.write_text(text)
    kind = {"curve": "check", "builds_on": "check", "design": "study"}.get(where, "sweep")
    out = () if kind == "check" else ("--out", tmp_path / "out")
    code, output = command(kind, file, *out)
    assert code == 2
    assert re.search("must be in the folder of the file that names it|not a usable file name|printable", output), output


def test_a_file_may_name_files_below_its_folder(tmp_path: Path) -> None:
    (tmp_path / "curves").mkdir()
    (tmp_path / "curves" / "tube.csv").write_bytes(b"stroke_mm,force_kN\n0,0\n73,800\n")
    (tmp_path / "my.yaml").write_text("builds_on: b_type_wall\ncurves: {buffer: {file: curves/tube.csv}}\n")
    assert trainmj.load(tmp_path / "my.yaml").curves["buffer"].force_kN == [0, 800]


EIGHT_THOUSANDS = [word for k in range(8) for word in ("--vary", f"curves.buffer.force_kN.{k}=1:2:1000")]


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("sweep", "b_type", "--vary", "mass_t=1:2:1000000000000"), "from 2 to 1000000"),
        (("sweep", "b_type", "--vary", "mass_t=1:2:1000000", "--vary", "speed_km_h=1:2:1000000"), "more than 10000000"),
        (("sweep", "b_type", *EIGHT_THOUSANDS), "2\\^79"),
        (("run", "b_type", "--set", "simulation.time_limit_s=60", "--set", "simulation.record_every_ms=0.1"), "records"),  # noqa: E501
        (("run", "b_type", "--set", "trains.b_type.vehicles=1000000000"), "at most 400"),
        (("run", "b_type", "--set", "mass_t=" + "9" * 5000), "is too large: numbers go up to"),
        (("run", "b_type", "--set", "mass_t=" + "[" * 100_000), "nested too deeply"),
        (("run", "x" * 5000), "not a usable file name"),
        (("sweep", "x" * 5000, "--vary", "mass_t=1,2"), "not a usable file name"),
    ],
)  # fmt: skip
def test_what_would_take_all_memory_is_refused_at_once(args: tuple[str, ...], said: str, tmp_path: Path) -> None:
    code, output = command(*args, "--out", tmp_path / "out")
    assert code == 2
    assert re.search(said, output), output
    assert len(output) < 6000


def test_too_few_given_points_are_refused(tmp_path: Path) -> None:
    """Found by the long run: a table cut short."""
    kind = next(kind for kind in KINDS if kind.name == "study of given points")
    for name, content in (good(kind) | {"points.csv": b"D,M,device\n20,30,link\n"}).items():
        (tmp_path / name).write_bytes(content)
    assert [code for code, _ in kind.use(tmp_path / kind.main, tmp_path)] == [2]


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("trials.sqlite", "trainmj identify TARGETS --out '.*my results' --report"),
        ("paper.html", "trainmj paper --out '.*my results'"),
    ],
)
def test_report_names_the_command_that_makes_the_page_of_other_results(file: str, said: str, tmp_path: Path) -> None:
    folder = tmp_path / "my results"
    folder.mkdir()
    (folder / file).write_bytes(b"")
    code, output = command("report", folder)
    assert code == 2
    assert re.search(said, output), output


def test_a_name_that_leads_to_a_shipped_scenario_and_to_something_here_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Breaks if what lies in the folder where a person works takes the place of a shipped scenario."""
    monkeypatch.chdir(tmp_path)
    short = ("--set", "simulation.time_limit_s=0.02", "--figures", "none")
    (tmp_path / "b_type_wall").mkdir()
    assert command("check", "b_type_wall")[0] == 0, "a folder that holds nothing hides nothing"
    assert command("run", "b_type_wall", *short, "--out", "b_type_wall")[0] == 0
    for words in (("run",), ("export",), ("compare", "b_type"), ("compare",)):
        code, output = command(*words, "b_type_wall", *(["b_type"] if words == ("compare",) else []))
        assert code == 2
        assert "b_type_wall: is a folder with a result here, and the name of a shipped scenario" in output
    assert command("run", "b_type_wall/result.nc")[0] == 0
    assert command("check", "b_type_wall.yaml")[0] == 0
    (tmp_path / "b_type_s08").write_text("builds_on: b_type\ntitle: Mine\n")
    code, output = command("check", "b_type_s08")
    assert code == 2
    assert "write ./b_type_s08 or b_type_s08.yaml" in output
    assert command("check", "./b_type_s08")[1].startswith("Mine")
    assert not command("check", "b_type_s08.yaml")[1].startswith("Mine")
