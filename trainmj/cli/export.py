"""The command export: a model or a result in the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.options import say, takes_scenario, takes_time, with_set
from trainmj.errors import InputError
from trainmj.files.folder import spare

if TYPE_CHECKING:
    from trainmj.collision.result import Result
    from trainmj.collision.summary import Summary
    from trainmj.exchange.deck import Deck
    from trainmj.scenario import Scenario

Files = dict[Path | None, str]
"""Texts by the files that they are for; None for the screen."""


def _mjcf(scenario: Scenario, out: Path | None) -> Files:
    from trainmj.view import scene

    return {out: scene.export(trainmj.line_up(scenario), _title(scenario))}


def _lsdyna(scenario: Scenario, out: Path | None) -> Files:
    from trainmj.exchange import lsdyna

    return {out: lsdyna.written(_deck(scenario, slips=False))}


def _radioss(scenario: Scenario, out: Path | None) -> Files:
    from trainmj.exchange import radioss

    if out is None:
        return {None: radioss.starter(_deck(scenario, slips=True), "trainmj")}
    run, engine = radioss.names(out)
    deck = _deck(scenario, slips=True)
    return {out: radioss.starter(deck, run), engine: radioss.engine(deck, run)}


def _deck(scenario: Scenario, slips: bool) -> Deck:
    from trainmj.exchange.assembly import assembled

    if scenario.plane != "line":
        raise InputError(
            f"plane: {scenario.plane} cannot be exported as a deck, whose nodes move along the track only: "
            "--set plane=line exports the collision along the track"
        )
    return assembled(trainmj.line_up(scenario), _title(scenario), slips)


def _title(scenario: Scenario) -> str:
    return f"{scenario.heading}: {scenario.subject}"


_MODELS: dict[str, Callable[[Scenario, Path | None], Files]] = {
    "mjcf": _mjcf,
    "lsdyna": _lsdyna,
    "radioss": _radioss,
}
"""The models of a scenario that can be written; with a file to write, all that goes with it."""

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
@takes_time
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

    Models. mjcf: MuJoCo's own viewer opens it. Stand-ins take the place of the devices, as a comment in the file says.

    lsdyna: a keyword file in t, mm, s and N: masses and discrete springs. A comment says what they do differently.

    radioss: likewise a starter file, named NAME_0000.rad, and beside it the engine file NAME_0001.rad.

    Results. xlsx: a workbook with summary, limits, interfaces, stages, vehicles, energy and histories.

    mme: the channels as an ISO-MME folder (ISO/TS 13499).

    csv: the tables, with separators of your choice.
    """
    if (separator or decimal) and kind != "csv":
        raise InputError(f"--{'separator' if separator else 'decimal'}: goes with --to csv")
    marks = {"separator": _SEPARATORS[separator or ","], "decimal": decimal or "."}
    if marks["separator"] == marks["decimal"]:
        raise InputError("--decimal ,: needs another separator between columns: --separator ';'")
    from trainmj.collision.saved import find_result

    saved = find_result(scenario)
    if kind in _MODELS:
        if saved is None:
            loaded = with_set(scenario, changes)
        else:
            loaded = trainmj.load_result(saved).scenario.with_values(changes)
        _write_model(loaded, kind, out, {*loaded.files, *([saved] if saved else [])})
        return
    if saved is not None and changes:
        raise InputError(f"--set: {scenario} is a result, which has no other values: export the scenario beside it")
    place = _place(kind, out, saved)
    result = trainmj.run(with_set(scenario, changes)) if saved is None else trainmj.load_result(saved)
    summary = trainmj.summarise(result)
    inputs = {*result.scenario.files, *([saved] if saved else [])}
    if kind not in _FOLDERS:
        spare(inputs, place)
    _RESULTS[kind](result, summary, place, inputs, marks)
    from trainmj.exchange.tables import validity

    said = f"; {validity(summary)}: {summary.status}" if summary.status.unusable else ""
    say(f"Written to {place}{'/' if kind in _FOLDERS else ''}{said}")


def _write_model(scenario: Scenario, kind: str, out: Path | None, inputs: Iterable[Path]) -> None:
    from trainmj.files.written import write_bytes

    for file, text in _MODELS[kind](scenario, out).items():
        if file is None:
            say(text)
            continue
        spare(inputs, file)
        write_bytes(file, text.encode())


def _place(kind: str, out: Path | None, saved: Path | None) -> Path:
    """Where a result is written; a wrong place is refused before anything is computed."""
    if out is None:
        raise InputError(f"--to {kind}: needs --out, the {'folder' if kind in _FOLDERS else 'file'} to write")
    if kind == "xlsx" and out.suffix.lower() != ".xlsx":
        raise InputError(f"--out {out}: must end in .xlsx, by which spreadsheets know what it is")
    if kind in _FOLDERS and saved is not None and out.resolve() == saved.parent.resolve():
        raise InputError(f"--out {out}: has the result that is exported: take another folder")
    return out
