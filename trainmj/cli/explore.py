"""The command explore: a scenario that answers at once, in the browser of this machine."""

from __future__ import annotations

import webbrowser
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Any

import click

import trainmj
from trainmj.cli.options import say, set_again, takes_scenario, takes_time
from trainmj.errors import InputError


@click.command()
@takes_scenario
@click.option(
    "--port", type=click.IntRange(0, 65535), metavar="N", default=0, help="Port to listen at; a free one by default."
)
@click.option("--no-browser", is_flag=True, help="Only print the address, and open no browser.")
@takes_time
def explore(scenario: str, changes: dict[str, Any], port: int, no_browser: bool) -> None:
    """Open a page on which values follow sliders, and the collision follows the values.

    One drags any number of the scenario, or points of its curves, and sees criteria, strokes, forces, energies and the
    moving train change at once; pins variants beside each other, saves the scenario and copies the command that
    computes it. The page is served to this machine only, at an address that nobody can guess, until Ctrl-C. It needs
    the extra: pip install 'trainmj[explore]'.
    """
    from trainmj.collision.saved import find_result
    from trainmj.explore.server import needed, serve
    from trainmj.explore.session import Session

    needed()
    if find_result(scenario) is not None:
        raise InputError(f"{scenario}: is a saved result: give the scenario.yaml beside it")

    def command(every: Mapping[str, Any]) -> str:
        return " ".join(["trainmj run", quote(scenario), *set_again(every)])

    def ready(address: str) -> None:
        say(f"Open {address}\nServed to this machine only; Ctrl-C stops it.")
        if not no_browser:
            webbrowser.open(address)

    serve(Session(Path(scenario).stem, trainmj.load(scenario), changes, command), port, ready)
