"""Commands about input files: check, scenarios, schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import trainmj
from trainmj.cli.completing import offers
from trainmj.cli.options import kind_of_input, say, takes_changes, takes_time, with_set
from trainmj.errors import InputError
from trainmj.files.kinds import KINDS

if TYPE_CHECKING:
    from trainmj.scenario import Scenario


DECKS = (".k", ".key", ".dyn")
"""Endings of keyword files."""

TABLES = (".csv", ".txt", ".tsv", ".xlsx", ".xlsm", ".xls", ".xlsb", ".ods", *DECKS)
"""Endings of files that check takes for tables."""

_SCHEMAS = ["scenario", "sweep", "study", "targets", "assessment", "partner", "reliability"]


@click.command()
@click.argument("file", shell_complete=offers(*KINDS, results=True))
@takes_changes
@takes_time
def check(file: str, changes: dict[str, Any]) -> None:
    """Check a file and print what would run.

    FILE is a scenario, sweep, study, targets, assessment, reliability or partner file, or the name of a shipped one,
    such as b_type or b_type.study.yaml. It may also be a table of curves, vehicles or cases (.csv, .xlsx), a saved
    result (.nc), or the folder of a command: then it says what is there, and what reads it. Nothing is computed.
    """
    from trainmj.cli.report import holds_results

    if holds_results(file):
        if changes:
            raise InputError(f"--set: {file} holds results, which cannot be changed")
        _say_results(file)
        return
    if Path(file).suffix.lower() in TABLES and Path(file).is_file():
        if changes:
            raise InputError(f"--set: {file} is a table, which states its own values")
        _say_tables(Path(file))
        return
    from trainmj.files.kinds import ASSESSMENT, PARTNER, RELIABILITY, SCENARIO, STUDY, SWEEP
    from trainmj.single.screen import print_chain

    kind = kind_of_input(file)
    if kind is SCENARIO:
        loaded = with_set(file, changes)
    elif kind is SWEEP:
        from trainmj.sweep import screen as of_sweep

        sweep = trainmj.load_sweep(file, changes)
        of_sweep.print_plan(sweep)
        loaded = sweep.scenario
        if sweep.load_cases:
            say(f"\nLoad case {next(iter(sweep.load_cases))}, the first of them:")
    elif kind is RELIABILITY:
        from trainmj.reliability import screen as of_reliability

        plan = trainmj.load_reliability(file, changes)
        of_reliability.print_plan(plan)
        loaded = next(iter(plan.scenarios.values()))
    elif changes:
        raise InputError(f"--set: the {kind.name} {file} states its values: change them there, under set")
    elif kind is ASSESSMENT:
        from trainmj.assessment import screen as of_assessment

        of_assessment.print_plan(trainmj.load_assessment(file))
        return
    elif kind is PARTNER:
        loaded = _run_into(file)
    elif kind is STUDY:
        from trainmj.study import screen as of_study

        study = trainmj.load_study(file)
        of_study.print_plan(study)
        loaded = study.scenario
    else:
        from trainmj.identification import screen as of_targets

        targets = trainmj.load_targets(file)
        of_targets.print_plan(targets)
        loaded = targets.start
    try:
        chain = trainmj.line_up(loaded)
    except InputError as error:
        if kind is not SWEEP:
            raise
        say(f"Note: the scenario as it stands: {error}")  # its cases may mend it
    else:
        if kind is not SCENARIO:
            say("")
        print_chain(loaded, chain)
        if kind is SCENARIO and loaded.tolerances:
            from trainmj.reliability import screen as of_reliability

            say("")
            of_reliability.print_tolerances(trainmj.load_reliability(file, changes))


def _say_results(file: str) -> None:
    """What results there are, whole or not, and what reads them."""
    from trainmj.cli.report import what_is_at
    from trainmj.collision.verdict import verdict

    kind, source = what_is_at(Path(file))
    if source.suffix == ".nc":
        result = trainmj.load_result(source)  # whole: a checksum covers every byte
        summary = trainmj.summarise(result)
        said = f"{file}: is a saved result, whole.\n{result.scenario.heading}\n{result.scenario.subject}\n"
        said += f"{verdict(summary).text}\nStatus: {summary.status}\n"
        say(f"{said}Read by: trainmj report, render, run (which computes it again and compares), export")
        return
    again = kind.cure.format(folder=source.parent) or f"trainmj report {source.parent}"
    say(f"{file}: holds {kind.name} ({source.name}). Its report: {again}")


def _say_tables(file: Path) -> None:
    """What tables a file has, and how an input file names each."""
    from trainmj.scenario import starter
    from trainmj.scenario.trains import VehiclesFile

    if file.suffix.lower() in DECKS:
        _say_curves(file)
        return
    found = list(starter.tables_in(file.parent, file))
    if not found:
        raise InputError(f"{file}: has no table on a sheet that is shown, with a line of heads above numbers")
    for place, table in found:
        n, written = len(table.lines), starter.flow(place)
        where = f"{file}, {place.sheet}" if place.sheet else f"{file}"
        if starter.is_curve(table):
            u, f = starter.points(file, table)
            _as_of_a_device(where, u, f)
            said, use = f"a curve of {n} points up to {u[-1]:g} mm and {max(f):g} kN", f"curve: {written}"
        elif starter.is_of_vehicles(table):
            try:
                VehiclesFile.values_of(table)
            except InputError as error:
                raise InputError(f"{where}: {error}") from None
            said, use = f"{n} vehicles", f"vehicles: {written}"
        else:
            said = f"{n} rows of {', '.join(table.columns)}"
            use = f"a sweep, study, reliability or targets file as a table or data: {place.file}"
        say(f"{where}: {said}; named by {use}")
        for note in table.notes:
            say(f"Note: {note}")


def _as_of_a_device(where: str, stroke_mm: list[float], force_kN: list[float]) -> None:
    """Refuse a curve that no device can have."""
    values = trainmj.load("b_type").values()
    curve = {"stroke_mm": stroke_mm, "force_kN": force_kN}
    values["devices"] |= {"any": {"curve": curve, "stiffness_kN_per_mm": 1000, "beyond": "hold"}}
    try:
        trainmj.Scenario.from_values(values)
    except InputError as error:
        raise InputError(f"{where}: no device can have this curve: {error}") from None


def _say_curves(file: Path) -> None:
    """What curves a keyword file has, and how a scenario names each."""
    from trainmj.files.tables import tables_in
    from trainmj.scenario import starter

    found = tables_in(file)
    if not found:
        raise InputError(f"{file}: is a keyword file without *DEFINE_CURVE")
    for one in found:
        named = starter.flow(one.place)
        click.echo(f"{file}: curve {one.place.id} of {one.rows} points; named by curve: {named} and its units")
    click.echo("Note: a keyword file does not say its units: state them, as in units: { stroke: mm, force: N }")


def _run_into(file: str) -> Scenario:
    """The scenario in which a shipped train runs into the partner of a file."""
    from trainmj.files.kinds import PARTNER
    from trainmj.files.resources import find_file
    from trainmj.scenario.partners import read_partner

    path = find_file(file, PARTNER.ending, "partner")
    title, name = read_partner(path).values["title"], path.name.removesuffix(PARTNER.ending)
    scenario = trainmj.load("b_type").with_partner(name, path.parent).with_values({"collision.partner": name})
    say(f"{title}. A scenario runs into it with collision.partner: {name}; here b_type does.")
    return scenario


@click.command()
@takes_time
def scenarios() -> None:
    """List the scenarios that ship with trainmj.

    Also lists partner, assessment, study, targets and reliability files, and the folder of all of them. Copy a file, or
    use it by its name.
    """
    from trainmj.files.resources import shipped_files, shipped_folder
    from trainmj.output.console import new_console, print_table
    from trainmj.output.table import Column, Table
    from trainmj.scenario import shipped

    columns = [Column(head, text=True) for head in ("Name", "What it is", "Parameters")]
    found = {name: trainmj.load(name) for name in shipped()}
    rows = [(name, scenario.title, "\n".join(scenario.parameters)) for name, scenario in found.items()]
    console = new_console()
    print_table(console, Table(columns, rows))
    say("")
    for what, ending, use in (
        ("Partners", ".partner.yaml", "trainmj run TRAIN --set collision.partner=NAME"),
        ("Assessments", ".assessment.yaml", "trainmj assess TRAIN --standard NAME"),
        ("Studies", ".study.yaml", "trainmj study NAME"),
        ("Targets", ".targets.yaml", "trainmj identify NAME"),
        ("Reliability", ".reliability.yaml", "trainmj reliability NAME"),
    ):
        console.print(f"{what}: {', '.join(sorted(shipped_files(ending)))} ({use})", markup=False)
    say(f"All of them are in {shipped_folder('scenarios')}")


@click.command()
@click.argument("kind", type=click.Choice(_SCHEMAS), default="scenario")
def schema(kind: str) -> None:
    """Print the JSON schema of a kind of input file, for editors.

    KIND is scenario (if left out), sweep, study, targets, assessment, partner or reliability.
    """
    from trainmj.assessment.file import AssessmentFile
    from trainmj.identification.file import TargetsFile
    from trainmj.reliability.file import ReliabilityFile
    from trainmj.scenario import files
    from trainmj.scenario.partners import PartnerFile
    from trainmj.study.file import StudyFile
    from trainmj.sweep.file import SweepFile

    if kind == "scenario":
        found = files.schema()
    else:
        models = {"sweep": SweepFile, "study": StudyFile, "targets": TargetsFile}
        models |= {"assessment": AssessmentFile, "partner": PartnerFile, "reliability": ReliabilityFile}
        model: Any = models[kind]
        found = {"$schema": files.JSON_SCHEMA} | model.model_json_schema() | {"title": f"trainmj {kind}"}
    say(json.dumps(found, indent=2))
