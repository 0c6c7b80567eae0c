"""Commands about input files: scenarios, schema."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from pydantic import BaseModel


@click.command()
def scenarios() -> None:
    """List the scenarios that ship with trainmj.

    Also lists study and targets files, and the folder of all of them. You can copy a file, or build on it by its name.
    """
    from trainmj.files.resources import shipped_files, shipped_folder
    from trainmj.output.console import console_table, new_console
    from trainmj.output.table import Column, Table
    from trainmj.scenario import load, shipped

    found = {name: load(name) for name in shipped()}
    columns = [Column("Name", text=True), Column("What it is", text=True), Column("Parameters", text=True)]
    rows = [(name, scenario.title, "\n".join(scenario.parameters)) for name, scenario in found.items()]
    new_console().print(console_table(Table(columns, rows)))
    click.echo()
    for what, ending, command in (("Studies", ".study.yaml", "study"), ("Targets", ".targets.yaml", "identify")):
        click.echo(f"{what}: {', '.join(shipped_files(ending))} (trainmj {command} NAME)")
    click.echo(f"All of them are in {shipped_folder('scenarios')}")


@click.command()
@click.argument("kind", type=click.Choice(["scenario", "sweep", "study", "targets"]), default="scenario")
def schema(kind: str) -> None:
    """Print the JSON schema of a kind of input file, for editors.

    KIND is scenario (if left out), sweep, study or targets.
    """
    click.echo(json.dumps(_schema(kind), indent=2))


def _schema(kind: str) -> dict[str, Any]:
    from trainmj.identification.file import TargetsFile
    from trainmj.scenario import schema as scenario_schema
    from trainmj.scenario.files import JSON_SCHEMA
    from trainmj.study.file import StudyFile
    from trainmj.sweep.file import SweepFile

    if kind == "scenario":
        return scenario_schema()
    models: dict[str, type[BaseModel]] = {"sweep": SweepFile, "study": StudyFile, "targets": TargetsFile}
    return {"$schema": JSON_SCHEMA} | models[kind].model_json_schema() | {"title": f"trainmj {kind}"}
