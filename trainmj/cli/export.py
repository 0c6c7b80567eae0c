"""The command export: a model or a result in the formats of other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.options import takes_scenario
from trainmj.files.folder import spare

if TYPE_CHECKING:
    from trainmj.scenario import Scenario


def _mjcf(scenario: Scenario) -> str:
    from trainmj.view import scene

    return scene.export(trainmj.line_up(scenario), f"{scenario.heading}: {scenario.subject}")


_MODELS: dict[str, Callable[[Scenario], str]] = {"mjcf": _mjcf}
"""The models of a scenario that can be written, each as one text."""


@click.command()
@takes_scenario
@click.option(
    "--to", "kind", type=click.Choice(list(_MODELS)), default="mjcf", show_default=True, help="What is written."
)
@click.option("--out", type=click.Path(path_type=Path), help="File to write; without it the text is printed.")
def export(scenario: str, changes: dict[str, Any], kind: str, out: Path | None) -> None:
    """Write the model of a scenario for another program.

    mjcf: MuJoCo's own viewer opens it. Stand-ins take the place of the devices, as a comment in the file says.
    """
    loaded = trainmj.load(scenario, changes)
    from trainmj.files.written import write_bytes

    if out is not None:
        spare(loaded.files, out)
    text = _MODELS[kind](loaded)
    if out is None:
        click.echo(text)
    else:
        write_bytes(out, text.encode())
