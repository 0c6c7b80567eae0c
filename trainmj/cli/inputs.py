"""Commands about input files: scenarios, schema."""

from __future__ import annotations

import json
from typing import Any

import click

import trainmj


@click.command()
def scenarios() -> None:
    """List the scenarios that ship with trainmj.

    Also lists study and targets files, and the folder of all of them. Copy a file, or build on it by its name.
    """
    from trainmj.files.resources import shipped_files, shipped_folder
    from trainmj.output.console import console_table, new_console
    from trainmj.output.table import Column, Table
    from trainmj.scenario import shipped

    columns = [Column(head, text=True) for head in ("Name", "What it is", "Parameters")]
    found = {name: trainmj.load(name) for name in shipped()}
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
    from trainmj.identification.file import TargetsFile
    from trainmj.scenario import files
    from trainmj.study.file import StudyFile
    from trainmj.sweep.file import SweepFile

    if kind == "scenario":
        found = files.schema()
    else:
        model: Any = {"sweep": SweepFile, "study": StudyFile, "targets": TargetsFile}[kind]
        found = {"$schema": files.JSON_SCHEMA} | model.model_json_schema() | {"title": f"trainmj {kind}"}
    click.echo(json.dumps(found, indent=2))
