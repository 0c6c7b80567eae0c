"""A folder may come from someone else: what lies in it is read within bounds, and nothing outside is touched."""

from __future__ import annotations

import json
import os
import re
import shutil
import sqlite3
import struct
from contextlib import closing
from hashlib import sha256
from pathlib import Path

import pytest
from builders import few, signed
from kinds import BASE, STUDY, TARGETS, TUBE, WANTED, command
from mutations import document

import trainmj
from trainmj.cli.report import write_report
from trainmj.errors import InputError, OutputError
from trainmj.files import folder as folders
from trainmj.files.sealed import sealed, unsealed
from trainmj.files.written import part_name, replacing, write_bytes
from trainmj.identification import run as identification
from trainmj.paper import PAGE
from trainmj.paper import output as paper
from trainmj.paper.figures import CAPTIONS
from trainmj.single import folder as single
from trainmj.study import run as study
from trainmj.sweep import run as sweep

FIGURES = ("--figures", "svg")
WORDS = {
    "run": ("run", "base.yaml", *FIGURES, "--report"),
    "sweep": ("sweep", "base.yaml", "--vary", "mass_t=30,33", "--histories", "0", "--parquet", "--report"),
    "study": ("study", "my.study.yaml", "--threads", "1", "--figures", "none", "--report"),
    "identify": ("identify", "my.targets.yaml", "--threads", "1", *FIGURES, "--report"),
}  # fmt: skip
OWN = {"run": single.OWN, "sweep": sweep.OWN, "study": study.OWN, "identify": identification.OWN}
every_command = pytest.mark.parametrize("name", WORDS)


def bare(name: str) -> tuple[str, ...]:
    """A command without figures, report and Parquet."""
    words = [word for word in WORDS[name] if word not in ("--report", "--parquet")]
    return tuple("none" if word == "svg" else word for word in words)


def inputs(place: Path) -> None:
    for file, values in (("base.yaml", BASE), ("my.study.yaml", STUDY), ("my.targets.yaml", TARGETS)):
        (place / file).write_text(document(values))
    (place / "tube.csv").write_bytes(TUBE)
    (place / "wanted.csv").write_bytes(WANTED)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What each command leaves, in a folder of its name."""
    place = tmp_path_factory.mktemp("made")
    inputs(place)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for name, words in WORDS.items():
            code, said = command(*words, "--out", name)
            assert code == 0, said
    return place


@pytest.fixture
def place(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of it, and a file that nothing may touch."""
    shutil.copytree(made, tmp_path / "in", symlinks=True)
    (tmp_path / "in" / "precious").write_text("mine")
    monkeypatch.chdir(tmp_path / "in")
    return tmp_path / "in"


def untouched(place: Path) -> bool:
    return (place / "precious").read_text() == "mine"


@every_command
def test_a_command_knows_all_that_it_leaves(name: str, made: Path) -> None:
    """What it does not know would neither be spared nor removed."""
    left = {file.name for file in (made / name).iterdir()} | ({"01_design.svg"} if name == "study" else set())
    assert len(left) >= 5
    assert not [file for file in left if not re.fullmatch(OWN[name], file)]


def test_the_paper_knows_all_that_it_leaves() -> None:
    names = {*(f"{figure}.png" for figure in CAPTIONS), PAGE, paper.SUMMARY, "table13_optimum.csv", "laws.csv"}
    assert not [name for name in names if not re.fullmatch(paper.OWN, name)]
    assert not re.fullmatch(paper.OWN, "tables.csv")


@pytest.mark.parametrize("name", few(["run", "sweep", "study", "identify"], 2))
def test_a_link_in_a_folder_is_replaced_and_never_followed(name: str, place: Path) -> None:
    stores = (".sqlite",)
    for file in list((place / name).iterdir()):
        if file.suffix not in stores:
            file.unlink()
            file.symlink_to("../precious")
    code, said = command(*WORDS[name], "--out", name)
    assert code == 0, said
    assert untouched(place)
    assert not [file.name for file in (place / name).iterdir() if file.is_symlink()]


@pytest.mark.parametrize(
    ("name", "file", "end"),
    [
        ("sweep", "results", ""),
        *(pytest.param("sweep", "results", end, marks=pytest.mark.thorough) for end in ("-journal", "-shm")),
        ("sweep", "results", "-wal"),
        ("study", "simulations", "-journal"),
        ("identify", "trials", ""),
    ],
)
def test_a_database_that_is_a_link_is_refused_and_fresh_removes_it(name: str, file: str, end: str, place: Path) -> None:
    """SQLite would write through it."""
    there = place / name / f"{file}.sqlite{end}"
    there.unlink(missing_ok=True)
    there.symlink_to("../precious")
    code, said = command(*bare(name), "--out", name)
    assert code == 2
    assert f"{there.name}: is a link to another file" in said
    if name == "sweep":
        code, said = command("report", name, "--out", "page.html")
        assert code == 2
        assert f"{there.name}: is a link to another file" in said
    code, said = command(*bare(name), "--out", name, "--fresh")
    assert code == 0, said
    assert untouched(place)


@every_command
def test_a_pipe_in_a_folder_is_refused_before_anything_is_computed(name: str, place: Path) -> None:
    """Who opens it waits for ever."""
    os.mkfifo(place / "new-pipe")
    (place / name / "summary.json").unlink(missing_ok=True)
    file = place / name / ("results.csv" if name == "sweep" else "summary.json")
    os.replace(place / "new-pipe", file)
    code, said = command(*bare(name), "--out", name)
    assert code == 2
    assert f"{file.name}: cannot be removed or replaced (is a pipe or a device)" in said


@pytest.mark.parametrize("words", [("export", "base.yaml"), ("report", "run"), bare("run")])
def test_a_link_that_a_person_names_is_replaced_unless_it_is_a_folder(words: tuple[str, ...], place: Path) -> None:
    link = place / "link"
    (place / "elsewhere").mkdir()
    link.symlink_to("elsewhere" if words[0] == "run" else "precious")
    code, said = command(*words, "--out", "link")
    assert code == 0, said
    assert untouched(place)
    assert link.is_symlink() == (words[0] == "run")
    assert (place / "elsewhere" / "result.nc").exists() == (words[0] == "run")


def test_a_hidden_file_that_is_not_finished_cannot_be_a_trap(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trainmj.files.written.part_name", lambda name: f".{name}.part")
    (place / ".a.txt.part").symlink_to("precious")
    with pytest.raises(OutputError, match=r"a\.txt: cannot be written"):
        write_bytes(place / "a.txt", b"other")
    assert untouched(place)


@pytest.mark.parametrize("file", ["/dev/shm/trainmj-test", "plain"])
def test_only_streams_are_written_to_as_they_are(file: str, place: Path) -> None:
    """Memory disks are under /dev too."""
    if not Path(file).parent.is_dir():
        pytest.skip("there is no such folder here")
    try:
        with replacing(file) as part:
            assert part.name != Path(file).name
    finally:
        Path(file).unlink(missing_ok=True)
    with replacing("/dev/null") as part:
        assert part == Path("/dev/null")


# inputs


SPARED = [
    (("run", "in/scenario.yaml"), "scenario.yaml"),
    (("run", "in/found.yaml"), "scenario.yaml"),
    (("run", "in/curves.yaml"), "vehicles.csv"),
    (("identify", "in/my.targets.yaml"), "scenario.yaml"),
    (("identify", "in/table.targets.yaml"), "fit.csv"),
    (("identify", "in/found.targets.yaml"), "found.yaml"),
    (("sweep", "in/my.sweep.yaml"), "results.csv"),
    (("study", "in/points.study.yaml"), "01_design.csv"),
]


@pytest.mark.parametrize(("words", "lost"), SPARED, ids=lambda value: value if isinstance(value, str) else value[-1])
def test_what_a_command_reads_is_not_written_over(
    words: tuple[str, ...], lost: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "in"
    place.mkdir()
    (place / "tube.csv").write_bytes(TUBE)
    for file in ("vehicles.csv", "tube.csv"):
        (place / file).write_bytes(TUBE)
    for file in ("fit.csv", "wanted.csv"):
        (place / file).write_bytes(WANTED)
    (place / "results.csv").write_text("mass_t\n30\n33\n")
    (place / "01_design.csv").write_text("D,M,device\n20,30,link\n30,31,head\n40,34,link\n50,36,head\n45,33,link\n")
    measured = {**TARGETS["data"]["measured"], "table": "fit.csv"}  # type: ignore[index]
    curves = {**BASE["curves"], "tube": {"file": "vehicles.csv"}}  # type: ignore[dict-item]
    for file, values in {
        "scenario.yaml": {**BASE, "notes": "Nobody wants to lose this."},
        "found.yaml": {"builds_on": "scenario.yaml"},
        "curves.yaml": {**BASE, "curves": curves},
        "my.targets.yaml": {**TARGETS, "scenario": "scenario.yaml"},
        "found.targets.yaml": {**TARGETS, "scenario": "found.yaml"},
        "base.yaml": BASE,
        "table.targets.yaml": {**TARGETS, "data": {**TARGETS["data"], "measured": measured}},  # type: ignore[dict-item]
        "my.sweep.yaml": {"scenario": "base.yaml", "cases": "results.csv"},
        "points.study.yaml": {**STUDY, "scenario": "base.yaml", "design": {"kind": "table", "file": "01_design.csv"}},
    }.items():
        (place / file).write_text(document(values))
    before = {file: file.read_bytes() for file in place.iterdir()}
    for out in ("in", "in/../in", str(place)):
        code, said = command(*words, "--out", out)
        assert code == 2, said
        assert re.search(rf"in/{lost}: is read by this command, which would replace it: take another --out", said)
    assert {file: file.read_bytes() for file in place.iterdir()} == before
    (tmp_path / "other").symlink_to("in")
    assert command(*words, "--out", "other")[0] == 2, "the same folder by another name"


@pytest.mark.parametrize(
    "words", [("export", "base.yaml", "--out", "base.yaml"), ("report", "run", "--out", "run/result.nc")]
)
def test_a_file_that_a_person_names_is_not_written_over_what_is_read(words: tuple[str, ...], place: Path) -> None:
    before = (place / words[-1]).read_bytes()
    code, said = command(*words)
    assert code == 2
    assert "is read by this command, which would replace it" in said
    assert (place / words[-1]).read_bytes() == before


# what an earlier command left


@pytest.mark.parametrize("name", ["run", "identify"])
def test_a_folder_holds_one_result_and_nothing_of_an_earlier_one(name: str, place: Path) -> None:
    """An old report or figure would show other numbers than the tables beside it."""
    (place / name / "notes.txt").write_text("mine")
    code, said = command(*bare(name), "--out", name)
    assert code == 0, said
    left = {file.name for file in (place / name).iterdir()}
    assert not [file for file in left if file.endswith((".svg", ".html"))]
    assert {"notes.txt", "summary.json", "scenario.yaml"} <= left


def test_a_report_of_fewer_cases_goes_when_a_sweep_goes_on(place: Path) -> None:
    with closing(sqlite3.connect(place / "sweep" / "results.sqlite")) as db, db:
        db.execute('DELETE FROM results WHERE "case" = 1')
        signed(db)
    code, said = command(*bare("sweep"), "--out", "sweep")
    assert code == 0, said
    left = {file.name for file in (place / "sweep").iterdir()}
    assert left == {"results.sqlite", "results.csv", "case_0.nc"}


def test_a_report_that_is_made_while_a_sweep_runs_goes_when_it_ends(place: Path) -> None:
    report = place / "other" / "report.html"

    def progress(finished: int) -> None:
        if finished:
            write_report("other")
            assert report.exists()

    trainmj.run_sweep(trainmj.grid_of(trainmj.load("base.yaml"), {"mass_t": "30,33"}), "other", progress=progress)
    assert not report.exists()
    assert write_report("other") == Path("other/report.html")


def test_the_report_of_a_case_goes_with_its_history(place: Path) -> None:
    for number in (0, 7):
        (place / "sweep" / f"case_{number}.html").write_text("old")
    assert command(*bare("sweep"), "--out", "sweep", "--fresh")[0] == 0
    assert not (place / "sweep" / "case_0.html").exists()
    assert (place / "sweep" / "case_7.html").exists(), "no history of this sweep"


def test_a_report_of_other_numbers_goes_when_a_study_changes_and_stays_when_it_does_not(place: Path) -> None:
    report = place / "study" / "report.html"
    assert command(*bare("study"), "--out", "study")[0] == 0
    assert report.exists()
    (place / "my.study.yaml").write_text(document({**STUDY, "weights": {"method": "own", "own": {"TS": 1, "TAMA": 1}}}))
    assert command(*bare("study"), "--out", "study")[0] == 0
    assert not report.exists()


def test_what_fails_leaves_the_earlier_result_as_it_was(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = {file.name: file.read_bytes() for file in (place / "run").iterdir()}
    monkeypatch.setattr("trainmj.single.figures.collision", lambda *_: (_ for _ in ()).throw(OutputError("full")))
    assert command(*WORDS["run"], "--out", "run")[0] == 2
    assert {file.name: file.read_bytes() for file in (place / "run").iterdir()} == before


@every_command
def test_what_a_killed_process_left_unfinished_goes_and_what_others_hide_stays(name: str, place: Path) -> None:
    gone, running = 2**22 + 1, os.getpid()  # no system counts its processes so far
    own = {f".summary.json.{gone}.abcd1234.part", f".report.html.{gone}.abcd1234.part"}
    others = {f".notes.txt.{gone}.abcd1234.part", ".result.nc.part", part_name("summary.json"), ".hidden"}
    stage = place / name / f".trainmj.{gone}.abcd1234.part"
    stage.mkdir()
    (stage / "result.nc").write_text("half")
    (place / name / f".trainmj.{gone}.linklink.part").symlink_to(place)
    for file in own | others:
        (place / name / file).write_text("half")
    pattern = OWN[name].replace("summary", "summary|results") if name == "sweep" else OWN[name]
    with folders.filling(place / name, pattern + r"|summary\.json"):
        left = {file.name for file in (place / name).iterdir() if file.name.startswith(".")}
    assert left == others
    assert (place / "precious").exists()
    assert any(str(running) in file for file in left), "another one may be at work on it"


# what lies in a folder


def test_a_study_names_no_file_of_the_person_as_its_own(place: Path) -> None:
    """--fresh would remove it."""
    state = place / "study" / "steps.json"
    steps = unsealed(state.read_bytes())
    (place / "study" / "notes.csv").write_text("mine")
    steps["design"]["files"]["notes.csv"] = sha256(b"mine").hexdigest()
    state.write_text(json.dumps(sealed(steps)))
    code, said = command(*bare("study"), "--out", "study", "--fresh")
    assert code == 2
    assert "names the file 'notes.csv', which is not a plain name such as 01_design.csv" in said
    assert (place / "study" / "notes.csv").exists()


DEEP = "[" * 200_000


@pytest.mark.parametrize(
    ("file", "what"),
    [
        pytest.param(file, what, marks=[pytest.mark.thorough] * (what != other))
        for file, other in (("02_simulations.csv", "pipe"), ("steps.json", DEEP), ("summary.json", "../precious"))
        for what in ("/dev/zero", "../precious", DEEP, "a\n" + "x" * 200_000, "pipe")
    ],
)
def test_a_study_from_someone_else_is_read_within_bounds(file: str, what: str, place: Path) -> None:
    """No file of elsewhere is read into a report, and nothing hangs."""
    there = place / "study" / file
    there.unlink()
    if what == "pipe":
        os.mkfifo(there)
    elif "/" in what:
        there.symlink_to(what)
    else:
        there.write_text(what)
    code, said = command("report", "study", "--out", "page.html")
    assert code == 2, said
    code, said = command(*bare("study"), "--out", "study")
    assert code == (2 if what == "pipe" else 0), said
    assert untouched(place)


ENDLESS = (
    "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT x AS \"case\", 'over' AS status FROM n"
)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (["DROP TABLE results", f"CREATE VIEW results AS {ENDLESS}"], "has the view results"),
        (["CREATE TRIGGER t AFTER INSERT ON results BEGIN DELETE FROM about; END"], "has the trigger t"),
        (["CREATE INDEX i ON results(status)"], "has the index i"),
        (["CREATE TABLE more (a)"], "has the table more"),
        (["ALTER TABLE results ADD COLUMN g AS (hex(zeroblob(10000000)))"], "has the table results"),
        (["ALTER TABLE results ADD COLUMN g DEFAULT 'much'"], "has the table results"),
        (["DROP TABLE results", "CREATE VIRTUAL TABLE results USING fts5(a)"], "has the table results"),
        (["UPDATE about SET value = zeroblob(100) WHERE key = 'scenario'"], "has other things than text"),
        (["UPDATE about SET value = hex(zeroblob(600000)) WHERE key = 'varied'"], "too big"),
        ([f"UPDATE about SET value = '{DEEP}' WHERE key = 'columns'"], "nested too deeply"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_database_from_someone_else_runs_nothing_and_ends(
    wrong: list[str], said: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("trainmj.cases.store._MOST_BYTES", 1_000_000)  # a hundredth, which is written sooner
    with closing(sqlite3.connect(place / "sweep" / "results.sqlite", isolation_level=None)) as db:
        for line in wrong:
            db.execute(line)
        if wrong[0].startswith("UPDATE"):
            signed(db)
    for words in (("report", "sweep", "--out", "page.html"), (*bare("sweep"), "--out", "sweep")):
        code, output = command(*words)
        assert code == 2
        assert said in output, output
    with pytest.raises(InputError, match=said):
        trainmj.read_table("sweep")


EDITS = [
    "UPDATE results SET TS_mm = TS_mm + 1e-9 WHERE rowid = 1",
    "UPDATE results SET reason = 'none'",
    "UPDATE results SET TS_mm = NULL WHERE rowid = 1",
    "DELETE FROM results WHERE rowid = 1",
    "INSERT INTO results (rowid, {key}, status, reason, TS_mm) VALUES (9999, 9999, 'over', '', 5)",
    "ALTER TABLE results RENAME COLUMN TS_mm TO TS_cm",
    "UPDATE about SET value = replace(value, 'mm', 'm') WHERE key = 'columns'",
    "DELETE FROM about WHERE key = 'columns'",
    "DELETE FROM about",
    "DELETE FROM about WHERE key = 'digest_of_rows'",
    "UPDATE results SET {key} = CASE rowid WHEN 1 THEN -1 ELSE {key} END",
]


@pytest.mark.parametrize("edit", EDITS)
def test_a_database_that_was_changed_by_hand_gives_no_number(edit: str, place: Path) -> None:
    """Breaks if a digit that is changed, a row that is lost or one that was never computed is taken for a result."""
    for name, file in (("sweep", "results"), ("study", "simulations"), ("identify", "trials")):
        there = {each: each.read_bytes() for each in (place / name).iterdir()}
        changed = place / name / f"{file}.sqlite"
        with closing(sqlite3.connect(changed, isolation_level=None)) as db:
            db.execute(edit.format(key='"case"' if name == "sweep" else "key"))
        there.pop(changed)
        for words in ((*bare(name), "--out", name), *([("report", name)] if name == "sweep" else [])):
            code, said = command(*words)
            assert code == 2, said
            assert f"{file}.sqlite: is damaged, or was changed by hand: start over with --fresh" in said
        assert all(each.read_bytes() == content for each, content in there.items())


def test_a_bit_that_flips_in_a_number_is_found(place: Path) -> None:
    """Breaks if a change that SQLite takes for another number goes through."""
    file = place / "sweep" / "results.sqlite"
    content, number = bytearray(file.read_bytes()), trainmj.read_table("sweep")["TS_mm"].iloc[1]
    at = content.index(struct.pack(">d", number))
    for bit in (0, 31, 62):
        flipped = bytearray(content)
        flipped[at + 7 - bit // 8] ^= 1 << bit % 8
        file.write_bytes(flipped)
        for words in (("report", "sweep"), (*bare("sweep"), "--out", "sweep")):
            code, said = command(*words)
            assert code == 2, said
            assert "results.sqlite: is damaged, or was changed by hand" in said
    file.write_bytes(content)
    assert command("report", "sweep")[0] == 0


@pytest.mark.parametrize("file", ["00_as_it_stands.csv", "02_simulations.csv", "summary.json", "steps.json"])
def test_a_study_in_which_a_digit_was_changed_has_no_report_until_it_is_made_again(file: str, place: Path) -> None:
    changed = place / "study" / file
    there = changed.read_text()
    at = there.rindex("1")
    changed.write_text(f"{there[:at]}2{there[at + 1 :]}")
    code, said = command("report", "study")
    assert code == 2
    assert f"study/{file}: is damaged, or was changed by hand: the same trainmj study command makes it again" in said
    assert command(*bare("study"), "--out", "study")[0] == 0
    assert changed.read_text() == there
    assert command("report", "study")[0] == 0


def test_a_row_that_its_key_does_not_lead_to_is_found(place: Path) -> None:
    """Breaks if a bit of an index makes a command compute a trial again, and keep it twice."""
    file = place / "identify" / "trials.sqlite"
    with closing(sqlite3.connect(file)) as db:
        ((key,),) = db.execute("SELECT key FROM results LIMIT 1")
    content = file.read_bytes()
    assert content.count(key.encode()) == 2, "in the table and in its index"
    for at in (content.index(key.encode()), content.rindex(key.encode())):
        file.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        code, said = command(*bare("identify"), "--out", "identify")
        assert code == 2, said
        assert "trials.sqlite: is damaged" in said


def test_a_database_of_another_command_is_not_gone_on_with(place: Path) -> None:
    """A study and an identification of one scenario state the same but for what they are."""
    study, trials = place / "study" / "simulations.sqlite", place / "identify" / "trials.sqlite"
    before = trials.read_bytes()
    shutil.copy(study, trials)
    code, said = command(*bare("identify"), "--out", "identify")
    assert code == 2
    assert "format trainmj study 2 then, trainmj identification 2 now" in said
    study.write_bytes(before)
    code, said = command(*bare("study"), "--out", "study")
    assert code == 0
    assert "every collision is computed again" in said


def test_the_summary_of_another_run_is_not_shown_beside_a_result(place: Path) -> None:
    """What was computed beside it, with other ties, is in there."""
    assert command("run", "base.yaml", "--figures", "none", "--set", "mass_t=31", "--out", "other")[0] == 0
    shutil.copy(place / "other" / "summary.json", place / "run")
    code, said = command("report", "run")
    assert code == 2
    assert "is not the summary of result.nc" in said
    (place / "run" / "summary.json").unlink()
    assert command("report", "run")[0] == 0
    (place / "run" / "summary.json").symlink_to("nowhere")
    assert command("report", "run")[0] == 2


def test_a_database_whose_pages_are_used_twice_is_refused(place: Path) -> None:
    """A few pages that point to each other can stand for a table without end."""
    file = place / "sweep" / "results.sqlite"
    with closing(sqlite3.connect(file)) as db:
        (size,) = db.execute("PRAGMA page_size").fetchone()
        (root,) = db.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'results'").fetchone()
    content = bytearray(file.read_bytes())
    page = bytearray(size)
    page[0] = 5  # an inner page of a table, with two cells that lead to the page itself
    page[3:5], page[5:7], page[8:12] = (2).to_bytes(2, "big"), (size - 20).to_bytes(2, "big"), root.to_bytes(4, "big")
    for n in range(2):
        at = size - 10 * (n + 1)
        page[12 + 2 * n : 14 + 2 * n] = at.to_bytes(2, "big")
        page[at : at + 5] = root.to_bytes(4, "big") + bytes([n + 1])
    content[size * (root - 1) : size * root] = page
    file.write_bytes(content)
    with pytest.raises(InputError, match="damaged"):
        trainmj.read_table("sweep")
    code, said = command(*bare("sweep"), "--out", "sweep")
    assert code == 2
    assert "damaged" in said


@pytest.mark.parametrize(("name", "file"), [("study", "simulations"), ("identify", "trials")])
@pytest.mark.parametrize("wrong", ["TS_mm = 'many'", "status = NULL", "reason = 5"])
def test_cases_that_are_no_numbers_are_not_gone_on_with(name: str, file: str, wrong: str, place: Path) -> None:
    with closing(sqlite3.connect(place / name / f"{file}.sqlite", isolation_level=None)) as db:
        db.execute(f"UPDATE results SET {wrong}")
        if "many" not in wrong:  # of a text among numbers there is no digest
            signed(db)
    for table in (place / name).glob("0*"):
        table.unlink()
    code, said = command(*bare(name), "--out", name)
    assert code == 2, said
    assert f"{file}.sqlite: is damaged, or was changed by hand: start over with --fresh" in said


def test_a_database_that_another_program_keeps_locked_is_said(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trainmj.cases.store.PATIENCE", 0.1)
    with closing(sqlite3.connect(place / "sweep" / "results.sqlite", isolation_level=None)) as db:
        db.execute("BEGIN EXCLUSIVE")
        code, said = command(*bare("sweep"), "--out", "sweep")
    assert code == 2
    assert "results.sqlite: another process is using this file: wait for it" in said


def test_a_damaged_scenario_in_a_database_is_said_with_the_file(place: Path) -> None:
    with closing(sqlite3.connect(place / "sweep" / "results.sqlite", isolation_level=None)) as db:
        db.execute("UPDATE about SET value = '[1' WHERE key = 'scenario'")
        signed(db)
    code, said = command(*bare("sweep"), "--out", "sweep")
    assert code == 2
    assert "results.sqlite: holds other results: the scenario:1:3: is not valid YAML" in " ".join(said.split())
