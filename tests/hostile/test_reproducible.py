"""A result says what it was made from, and can be made again, bit for bit."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from builders import by_xarray
from kinds import BASE, STUDY, TUBE, command
from mutations import document

import trainmj
from trainmj.cases.engine import Local
from trainmj.cases.rows import Rows
from trainmj.cases.store import Store
from trainmj.collision.cases import Cases
from trainmj.collision.identity import identity
from trainmj.collision.quantities import Column
from trainmj.collision.repeated import repeated

SHORT = ("--set", "simulation.time_limit_s=0.05", "--set", "simulation.step_ms=0.2")
VERSIONS = {"trainmj", "mujoco", "numba", "numpy", "python", "platform", "law"}


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "out"
    code, output = command("run", "b_type_wall", *SHORT, "--out", folder, "--figures", "none")
    assert code == 0, output
    return folder


@pytest.fixture
def copy(saved: Path, tmp_path: Path) -> Path:
    file = tmp_path / "result.nc"
    file.write_bytes((saved / "result.nc").read_bytes())
    return file


def test_a_result_records_scenario_versions_platform_and_step(saved: Path) -> None:
    result = trainmj.load_result(saved / "result.nc")
    assert set(result.versions) == VERSIONS
    assert all(result.versions.values())
    assert result.step_ms == 0.2
    assert result.scenario.values() == trainmj.load(saved / "scenario.yaml").values()
    with xr.open_dataset(saved / "result.nc") as data:
        assert data.attrs["step_ms"] == 0.2


@pytest.mark.parametrize("name", ["", "result.nc"])
def test_a_result_or_its_folder_is_repeated_bit_for_bit(saved: Path, name: str) -> None:
    code, output = command("run", saved / name)
    assert code == 0
    assert "The same as the saved result, bit for bit." in output
    assert "Versions and code are the same." in output
    code, output = command("run", saved / name, "--json")
    assert json.loads(output)["repeated"] == {"same": True, "differences": {}, "changes": []}


def test_a_number_that_differs_is_said_with_exit_code_1(copy: Path) -> None:
    before = trainmj.load_result(copy)
    before.force[3, 2] += 1e-6
    before.versions["mujoco"] = "3.9.0"
    before.save(copy)
    code, output = command("run", copy)
    assert code == 1
    assert "Differs from the saved result: force by" in output
    assert "mujoco 3.9.0 then" in output
    before = trainmj.load_result(copy)
    again = repeated(before, trainmj.run(before.scenario))
    assert list(again.differences) == ["force"]
    assert 0 < again.differences["force"] < 1e-9


def test_the_step_is_that_of_the_result_even_if_the_default_is_another(copy: Path) -> None:
    data = trainmj.load_result(copy).dataset().assign_attrs(step_ms=0.1)
    copy.write_bytes(by_xarray(data))
    result = trainmj.load_result(copy)
    assert result.step_ms == result.scenario.simulation.step_ms == 0.1


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("--set", "mass_t=30"), "is computed again as it was"),
        (("--out", "."), "has the result that is computed again"),
    ],
)
def test_a_repetition_is_neither_changed_nor_written_over(
    copy: Path, args: tuple[str, ...], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(copy.parent)
    code, output = command("run", copy, *args)
    assert code == 2
    assert said in output


@pytest.fixture
def base(tmp_path: Path) -> Path:
    (tmp_path / "tube.csv").write_bytes(TUBE)
    (tmp_path / "base.yaml").write_text(document(BASE))
    return tmp_path


def test_a_sweep_is_the_same_for_any_threads_and_says_what_made_it(base: Path) -> None:
    args = ("sweep", base / "base.yaml", "--vary", "mass_t=30:60:12", "--vary", "gap=20,40")
    for threads in ("1", "2"):
        code, output = command(*args, "--threads", threads, "--out", base / threads)
        assert code == 0, output
    assert (base / "1" / "results.csv").read_bytes() == (base / "2" / "results.csv").read_bytes()
    with sqlite3.connect(base / "1" / "results.sqlite") as db:
        about = dict(db.execute("SELECT key, value FROM about"))
    assert {f"version_{name}" for name in VERSIONS} | {"scenario", "seed", "values", "responses"} <= set(about)
    assert "step_ms: 0.2" in about["scenario"]


MIXED: dict[str, Any] = {
    "scenario": "base.yaml",
    "together": {"gap": [20, 30.5, 40], "trains.wagons.drawing": ["wagon", None, "coach"]},
    "vary": {"collision.partner": ["wagons", "rigid_wall"], "mass_t": [30, 36]},
}


def test_the_files_of_a_sweep_are_the_same_whichever_case_ends_first(base: Path) -> None:
    """Breaks if the type of a column, the order of columns or rows, or what the file says of itself is by chance."""
    (base / "my.sweep.yaml").write_text(document(MIXED))
    plan = trainmj.load_sweep(base / "my.sweep.yaml")
    folders = [base / name for name in ("forwards", "backwards", "two", "eight")]
    trainmj.run_sweep(plan, folders[0], threads=1)
    with pytest.raises(KeyboardInterrupt):
        trainmj.run_sweep(plan, folders[1], engine=Backwards(plan.scenario, stop_after=5))
    trainmj.run_sweep(plan, folders[1], engine=Backwards(plan.scenario))
    for threads, folder in zip((2, 8), folders[2:], strict=True):
        trainmj.run_sweep(plan, folder, threads=threads)
    trainmj.run_sweep(plan, folders[2])  # computes nothing
    first, *others = map(bytes_of, folders)
    assert set(first) == {"results.csv", "results.sqlite"}
    assert all(other == first for other in others)
    table = trainmj.read_table(folders[1])
    assert table["gap"].tolist()[::4] == [20, 30.5, 40]
    assert table["gap"].dtype == float
    assert {"stroke_M1_wall_mm", "stroke_S1_M1_mm"} <= set(table), "the columns of a case depend on what it varies"


def bytes_of(folder: Path) -> dict[str, str]:
    """A digest of each file of a folder, by its name."""
    return {file.name: sha256(file.read_bytes()).hexdigest() for file in folder.iterdir()}


def test_what_a_store_says_of_a_column_does_not_depend_on_the_chain_that_came_first(tmp_path: Path) -> None:
    """Chains of other vehicles and stages have the same column at other places of the table."""
    wall, wagons = (
        Column(name, "mm", 1, name, "A stroke.", "stroke_mm", place)
        for name, place in (("stroke_A_mm", (1, 4)), ("stroke_A_mm", (1, 0)))
    )
    other = Column("stroke_B_mm", "mm", 1, "stroke B", "A stroke.", "stroke_mm", (1, 2))
    rows = [
        Rows([case], {"status": ["over"], "reason": [""]}, {c.name: c for c in columns}, np.ones((1, 2)) * case)
        for case, columns in enumerate([(wall, other), (other, wagons)])
    ]
    for name, order in (("one", rows), ("other", rows[::-1])):
        (tmp_path / name).mkdir()
        with Store(tmp_path / name / "results.sqlite") as store:
            store.prepare({"status": "", "reason": ""})
            for some in order:
                store.add([some])
            store.write_csv(tmp_path / name / "results.csv")
            store.finish()
    assert bytes_of(tmp_path / "one") == bytes_of(tmp_path / "other")


@pytest.mark.thorough
def test_a_sweep_leaves_the_same_bytes_twelve_times(base: Path) -> None:
    from trainmj.cases.cluster import LOCAL, connected

    plan = trainmj.sweep_of({**MIXED, "vary": {**MIXED["vary"], "mass_t": "30:36:40"}, "histories": [0, 7]}, base)
    for n in range(3):
        for threads in (1, 2, 8):
            trainmj.run_sweep(plan, base / f"{n} {threads}", threads=threads)
        with connected(LOCAL, plan.scenario) as engine:
            trainmj.run_sweep(plan, base / f"{n} dask", engine=engine)
    first, *others = (bytes_of(folder) for folder in base.iterdir() if folder.is_dir())
    assert set(first) == {"results.csv", "results.sqlite", "case_0.nc", "case_7.nc"}
    assert len(others) == 11
    assert all(other == first for other in others)


class Backwards:
    """Computes the last case first, each by itself, and is stopped after some of them."""

    def __init__(self, scenario: trainmj.Scenario, stop_after: int = 100) -> None:
        self.scenario, self.left, self.identity = scenario, stop_after, identity()

    def of(self, scenario: trainmj.Scenario, responses: Sequence[str] = ("*",)) -> Backwards:
        return self

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Rows]:
        each = [some.take([place]) for some in cases for place in range(len(some))]
        for case in reversed(each):
            yield from Local(self.scenario, 1)([case])
            self.left -= 1
            if not self.left:
                raise KeyboardInterrupt


def test_a_study_is_the_same_for_any_threads_and_says_what_made_it(base: Path) -> None:
    (base / "my.study.yaml").write_text(document(STUDY))
    summaries = []
    for threads in (1, 2):
        trainmj.run_study(base / "my.study.yaml", base / str(threads), threads=threads, figures=())
        summaries.append(json.loads((base / str(threads) / "summary.json").read_text()))
    names = {p.name for p in (base / "1").glob("*.csv")}
    assert len(names) > 8
    for name in names:
        assert (base / "1" / name).read_bytes() == (base / "2" / name).read_bytes(), name
    assert bytes_of(base / "1") == bytes_of(base / "2")
    (base / "2" / "04_anova.csv").unlink()
    trainmj.run_study(base / "my.study.yaml", base / "2", threads=1, figures=())
    assert bytes_of(base / "1") == bytes_of(base / "2"), "a step that is done again leaves what it left"
    assert summaries[0] == summaries[1]
    assert set(summaries[0]["versions"]) == VERSIONS
    assert summaries[0]["study"]["design"]["seed"] == 1
    assert "step_ms: 0.2" in summaries[0]["scenario"]
    assert len(pd.read_csv(base / "1" / "02_simulations.csv")) == 8


def test_a_folder_in_which_nothing_was_finished_leaves_no_trace_in_another_sweep(base: Path) -> None:
    """Breaks if columns, or what is said of cases, stay there without a case."""
    scenario = trainmj.load(base / "base.yaml")
    with pytest.raises(KeyboardInterrupt):
        trainmj.run_sweep(trainmj.grid_of(scenario, {"gap": [20, 30]}), base / "out", engine=Stopped(scenario))
    with closing(sqlite3.connect(base / "out" / "results.sqlite")) as db:
        assert ("gap",) in list(db.execute("SELECT name FROM pragma_table_info('results')"))
    for folder in ("out", "new"):
        trainmj.run_sweep(trainmj.grid_of(scenario, {"mass_t": [30, 36]}), base / folder, threads=1)
    assert bytes_of(base / "out") == bytes_of(base / "new")


class Stopped(Backwards):
    """Is stopped before the first case."""

    def __call__(self, cases: Iterable[Cases]) -> Iterator[Rows]:
        raise KeyboardInterrupt
