"""The command export: a model or a result in the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.options import takes_scenario
from trainmj.errors import InputError
from trainmj.files.folder import spare

if TYPE_CHECKING:
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


@click.command()
@takes_scenario
@click.option(
    "--to", "kind", type=click.Choice(list(_MODELS)), default="mjcf", show_default=True, help="What is written."
)
@click.option("--out", type=click.Path(path_type=Path), help="File to write; without it the text is printed.")
def export(scenario: str, changes: dict[str, Any], kind: str, out: Path | None) -> None:
    """Write the model of a scenario for another program.

    mjcf: MuJoCo's own viewer opens it. Stand-ins take the place of the devices, as a comment in the file says.

    lsdyna: a keyword file in t, mm, s and N: masses and discrete springs. A comment says what they do differently.

    radioss: likewise a starter file, named NAME_0000.rad, and beside it the engine file NAME_0001.rad.
    """
    loaded = trainmj.load(scenario, changes)
    from trainmj.files.written import write_bytes

    for file, text in _MODELS[kind](loaded, out).items():
        if file is None:
            click.echo(text)
            continue
        spare(loaded.files, file)
        write_bytes(file, text.encode())
