"""The command new: a first scenario of one's own."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import Any

import click

from trainmj.cli.completing import offers
from trainmj.cli.options import F
from trainmj.errors import InputError
from trainmj.files.kinds import PARTNER

_ASKED: dict[str, tuple[str, Any, Any]] = {
    "vehicles": ("How many vehicles has the train", click.IntRange(1, 100), 4),
    "mass_t": ("Mass of each [t]", click.FloatRange(0.1, 1000), 33.0),
    "length_m": ("Length of each [m]", click.FloatRange(0.5, 100), 20.0),
    "front_force_kN": ("Crush force at the ends [kN]", click.FloatRange(1, 50_000), 1000.0),
    "front_stroke_mm": ("Stroke there [mm]", click.FloatRange(5, 10_000), 600.0),
    "coupler_force_kN": ("Crush force between vehicles [kN]", click.FloatRange(1, 50_000), 800.0),
    "coupler_stroke_mm": ("Stroke there [mm]", click.FloatRange(5, 10_000), 400.0),
    "speed_km_h": ("Speed [km/h]", click.FloatRange(0, 500, min_open=True), 20.0),
    "partner": ("Into what: twin, rigid_wall, or a partner of `trainmj scenarios`", str, "twin"),
}
"""What is asked, of which kind the answer is, and what is taken if there is none."""


def _option(name: str, said: str) -> Callable[[F], F]:
    _, kind, default = _ASKED[name]
    shown = f"{said} [default: {default:g}]" if isinstance(default, float | int) else f"{said} [default: {default}]"
    offered = offers(PARTNER) if name == "partner" else None
    words = f"--{name.replace('_', '-').lower()}", name
    return click.option(*words, type=kind, help=shown, metavar="VALUE", shell_complete=offered)


@click.command()
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--from",
    "tables",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="TABLE",
    help="Workbook (.xlsx) or CSV file beside FILE: curves with columns stroke_mm and force_kN, vehicles with columns "
    "name and mass_t; heads may state other units. May be repeated.",
)
@click.option("--front", metavar="NAME", help="With --from: sheet or file with the curve at the ends of the train.")
@click.option("--between", metavar="NAME", help="With --from: sheet or file with the curve between vehicles.")
@_option("vehicles", "How many vehicles the train has.")
@_option("mass_t", "Mass of each vehicle in t.")
@_option("length_m", "Length of each vehicle in m.")
@_option("front_force_kN", "Crush force at the ends of the train in kN.")
@_option("front_stroke_mm", "Stroke there in mm.")
@_option("coupler_force_kN", "Crush force between vehicles in kN.")
@_option("coupler_stroke_mm", "Stroke there in mm.")
@_option("speed_km_h", "Speed in km/h.")
@_option("partner", "What it runs into: twin, rigid_wall, or the name of a partner that ships.")
@click.option("--yes", is_flag=True, help="Ask nothing: take the defaults of what is not stated.")
def new(file: Path, tables: tuple[Path, ...], front: str | None, between: str | None, yes: bool, **stated: Any) -> None:
    """Write a first scenario of your own to FILE.

    On a terminal it asks for what no option states. The file runs as it is, and says beside each value what it means.
    A file that is there is left as it is.
    """
    if file.exists():
        raise InputError(f"{file}: is there already: give another name, or remove it")
    if file.suffix not in (".yaml", ".yml"):
        raise InputError(f"{file}: must end in .yaml")
    if not tables and (front or between):
        raise InputError("--front and --between: name a table of --from, which is not given")
    from trainmj.collision.lineup import line_up
    from trainmj.files.written import write_bytes
    from trainmj.scenario import load, starter

    data = starter.read_data(file.parent, tables) if tables else None
    asks = is_asked(yes)
    left_out = {name for name in _ASKED if data and (name.endswith(("force_kN", "stroke_mm")))}
    left_out |= {"vehicles"} if data and data.vehicles else set()
    if given := [name for name in left_out if stated[name] is not None]:
        raise InputError(f"--{given[0].replace('_', '-').lower()}: is in the tables of --from: leave it out")
    values = {name: _answer(name, stated[name], asks) for name in _ASKED if name not in left_out}
    if data:
        ends = data.device(front, starter.AT_ENDS, starter.BETWEEN)
        joint = data.device(between, starter.BETWEEN, starter.AT_ENDS)
        others = data.devices if data.vehicles else ()
    else:
        ends = starter.Crush.constant("front", values["front_force_kN"], values["front_stroke_mm"])
        joint = starter.Crush.constant("coupler", values["coupler_force_kN"], values["coupler_stroke_mm"])
        others = ()
    vehicles = data.vehicles if data and data.vehicles else f"{values['vehicles']}"
    plain = {name: values[name] for name in ("mass_t", "length_m", "speed_km_h", "partner")}
    text = starter.Start(file.stem, vehicles, **plain, ends=ends, between=joint, others=others).text()
    write_bytes(file, text.encode())
    try:
        line_up(load(file))
    except InputError as error:
        file.unlink()
        raise InputError(f"nothing is written: {error}") from None
    if data:
        click.echo(f"{ends.name} is at the ends of the train, {joint.name} between its vehicles.")
        if idle := [device.name for device in data.devices if device not in (ends, joint)]:
            where = "only where vehicles name it" if data.vehicles else "not used"
            click.echo(f"{', '.join(idle)}: {where}; --front NAME and --between NAME take another one.")
    click.echo(f"Written to {file}. What would run, and the collision:")
    click.echo(f"  trainmj check {quote(str(file))}")
    click.echo(f"  trainmj run {quote(str(file))} --out {quote(file.stem)} --report")


def is_asked(yes: bool) -> bool:
    """Whether there is somebody to ask."""
    return not yes and sys.stdin is not None and sys.stdin.isatty()


def _answer(name: str, stated: Any, asks: bool) -> Any:
    """What an option states, what is asked for, or the default."""
    text, kind, default = _ASKED[name]
    if stated is not None:
        return stated
    return click.prompt(text, type=kind, default=default, err=True) if asks else default
