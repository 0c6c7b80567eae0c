"""Commands about input files: scenarios, schema."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from pydantic import BaseModel

    from trainmj.scenario import Scenario


@click.command()
def scenarios() -> None:
    """List the scenarios that ship with trainmj.

    Also studies and targets files, and the folder of all of them: a file may be copied, or built on by its name.
    """
    from trainmj.files.resources import shipped_files, shipped_folder
    from trainmj.scenario import load, shipped

    _print_scenarios({name: load(name) for name in shipped()})
    click.echo()
    for what, ending, command in (("Studies", ".study.yaml", "study"), ("Targets", ".targets.yaml", "identify")):
        click.echo(f"{what}: {', '.join(shipped_files(ending))} (trainmj {command} NAME)")
    click.echo(f"All are in {shipped_folder('scenarios')}")


def _print_scenarios(scenarios: Mapping[str, Scenario]) -> None:
    """Names, titles and parameters of scenarios."""
    from rich import box
    from rich.table import Table

    from trainmj.output.console import new_console

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column("Name", style="bold", no_wrap=True)
    table.add_column("What it is")
    table.add_column("Parameters")
    for name, scenario in scenarios.items():
        table.add_row(name, scenario.title, "\n".join(scenario.parameters))
    new_console().print(table)


@click.command()
@click.argument("kind", type=click.Choice(["scenario", "sweep", "study", "targets"]), default="scenario")
def schema(kind: str) -> None:
    """Print the JSON schema of a kind of input file, for editors.

    KIND is scenario (if left out), sweep, study or targets.
    """
    click.echo(json.dumps(_schema(kind), indent=2))


def _schema(kind: str) -> dict[str, Any]:
    if kind == "scenario":
        from trainmj.scenario import schema as scenario_schema

        return scenario_schema()
    model: type[BaseModel]
    if kind == "sweep":
        from trainmj.sweep.file import SweepFile

        model = SweepFile
    elif kind == "study":
        from trainmj.study.file import StudyFile

        model = StudyFile
    else:
        from trainmj.identification.file import TargetsFile

        model = TargetsFile
    from trainmj.scenario.files import JSON_SCHEMA

    return {"$schema": JSON_SCHEMA} | model.model_json_schema() | {"title": f"trainmj {kind}"}
