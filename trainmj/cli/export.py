"""The command export: a model or a result in the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.options import takes_scenario
from trainmj.errors import InputError
from trainmj.files.folder import spare

if TYPE_CHECKING:
    from trainmj.collision.result import Result
    from trainmj.collision.summary import Summary
    from trainmj.scenario import Scenario


def _mjcf(scenario: Scenario) -> str:
    from trainmj.view import scene

    return scene.export(trainmj.line_up(scenario), f"{scenario.heading}: {scenario.subject}")


_MODELS: dict[str, Callable[[Scenario], str]] = {"mjcf": _mjcf}
"""The models of a scenario that can be written, each as one text."""

Written = Callable[["Result", "Summary", Path, Iterable[Path], dict[str, str]], None]


def _xlsx(result: Result, summary: Summary, out: Path, inputs: Iterable[Path], _: dict[str, str]) -> None:
    from trainmj.exchange import workbook
    from trainmj.files.written import write_bytes

    write_bytes(out, workbook.write(result, summary))


def _mme(result: Result, summary: Summary, out: Path, inputs: Iterable[Path], _: dict[str, str]) -> None:
    from trainmj.exchange import mme

    mme.write(result, summary, out, inputs)


def _csv(result: Result, summary: Summary, out: Path, inputs: Iterable[Path], marks: dict[str, str]) -> None:
    from trainmj.exchange import tables

    tables.write(result, summary, out, inputs, **marks)


_RESULTS: dict[str, Written] = {"xlsx": _xlsx, "mme": _mme, "csv": _csv}
"""The forms in which a result can be written: a file, or a folder."""

_FOLDERS = ("mme", "csv")
_SEPARATORS = {",": ",", ";": ";", "tab": "\t"}


@click.command()
@takes_scenario
@click.option(
    "--to",
    "kind",
    type=click.Choice([*_MODELS, *_RESULTS]),
    default="mjcf",
    show_default=True,
    help="What is written.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="File to write, of mme and csv a folder; without it the text of a model is printed.",
)
@click.option(
    "--separator", type=click.Choice(list(_SEPARATORS)), help="With csv: between columns; a comma by default."
)
@click.option("--decimal", type=click.Choice([".", ","]), help="With csv: the decimal mark; a point by default.")
def export(
    scenario: str,
    changes: dict[str, Any],
    kind: str,
    out: Path | None,
    separator: str | None,
    decimal: str | None,
) -> None:
    """Write a model or a result for another program.

    SCENARIO may also be a saved result, or the folder of one. Of a scenario a result is computed first.

    \b
    mjcf  the model, for MuJoCo's own viewer; stand-ins take the place of the
          devices, as a comment in the file says
    xlsx  the result as a workbook: summary, limits, interfaces, stages,
          vehicles, energy, histories
    mme   the channels of the result as an ISO-MME folder (ISO/TS 13499)
    csv   the tables of the result, with separators of your choice
    """
    if (separator or decimal) and kind != "csv":
        raise InputError(f"--{'separator' if separator else 'decimal'}: goes with --to csv")
    marks = {"separator": _SEPARATORS[separator or ","], "decimal": decimal or "."}
    if marks["separator"] == marks["decimal"]:
        raise InputError("--decimal ,: needs another separator between columns: --separator ';'")
    if kind in _RESULTS:
        _check_place(kind, out)
    from trainmj.collision.result import find_result
    from trainmj.files.written import write_bytes

    saved = find_result(scenario)
    if saved is not None and changes:
        raise InputError(f"--set: {scenario} is a result, which has no other values: export the scenario beside it")
    before = None if saved is None else trainmj.load_result(saved)
    loaded = trainmj.load(scenario, changes) if before is None else before.scenario
    inputs = loaded.files if saved is None else {*loaded.files, saved}
    if kind in _MODELS:
        if out is not None:
            spare(inputs, out)
        text = _MODELS[kind](loaded)
        if out is None:
            click.echo(text)
        else:
            write_bytes(out, text.encode())
        return
    assert out is not None
    if kind not in _FOLDERS:
        spare(inputs, out)
    elif saved is not None and out.resolve() == saved.parent.resolve():
        raise InputError(f"--out {out}: has the result that is exported: take another folder")
    result = trainmj.run(loaded) if before is None else before
    summary = trainmj.summarise(result)
    _RESULTS[kind](result, summary, out, inputs, marks)
    from trainmj.exchange.tables import validity

    said = f"; {validity(summary)}: {summary.status}" if summary.status.unusable else ""
    click.echo(f"Written to {out}{'/' if kind in _FOLDERS else ''}{said}")


def _check_place(kind: str, out: Path | None) -> None:
    """Refuse a place for a result before anything is computed."""
    if out is None:
        raise InputError(f"--to {kind}: needs --out, the {'folder' if kind in _FOLDERS else 'file'} to write")
    if kind == "xlsx" and out.suffix.lower() != ".xlsx":
        raise InputError(f"--out {out}: must end in .xlsx, by which spreadsheets know what it is")
