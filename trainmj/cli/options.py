"""What several commands take: a scenario with changes, a folder to go on in, figures."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from trainmj.cli.completing import offers, settings
from trainmj.errors import InputError
from trainmj.files.kinds import SCENARIO
from trainmj.files.text import allowed, allowing, printable

if TYPE_CHECKING:
    from trainmj.files.kinds import Kind
    from trainmj.scenario import Scenario

F = TypeVar("F", bound=Callable[..., Any])


def parts_of(text: str) -> tuple[str, ...]:
    """The parts of a text with commas between."""
    return tuple(part.strip() for part in text.split(","))


def split_assignment(option: str, text: str, example: str) -> tuple[str, str]:
    """Path and value of PATH=VALUE."""
    path, equals, value = text.partition("=")
    if not (equals and path.strip() and value.strip()):
        raise InputError(f"{option} {text}: must be PATH=VALUE, as in {option} {example}")
    return path.strip(), value.strip()


def _changes(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """The values of --set, read as YAML reads them."""
    if not texts:
        return {}
    from trainmj.files.yaml import read_value

    changes: dict[str, Any] = {}
    for text in texts:
        path, value = split_assignment("--set", text, "mass_t=33")
        if path in changes:
            raise InputError(f"--set {text}: {path} is set twice")
        changes[path] = read_value(value, f"--set {text}")
    return changes


def with_set(scenario: str, changes: Mapping[str, Any]) -> Scenario:
    """The scenario of a file with the values of --set, each of which has an effect.

    Raises:
        InputError: if the file or a value breaks a rule, or what would change is stated by another value.
    """
    from trainmj.scenario import load

    found = load(scenario, changes)
    if changes:
        from trainmj.cases.effect import idle_held, refuse

        refuse(idle_held([found], changes))
    return found


def set_again(changes: Mapping[str, Any]) -> list[str]:
    """The words that make the same changes again, and allow the same folders."""
    said = {path: value if isinstance(value, str) else json.dumps(value) for path, value in changes.items()}
    folders = [f"--allow-folder {quote(str(folder))}" for folder in allowed()]
    return [*(f"--set {quote(f'{path}={value}')}" for path, value in said.items()), *folders]


def _allow(context: click.Context, parameter: click.Parameter, folders: tuple[str, ...]) -> None:
    """Allow the folders of --allow-folder until the command ends."""
    context.with_resource(allowing(folders))


def kind_of_input(file: str) -> Kind:
    """The kind of an input file, by its path or the name of a shipped one.

    Raises:
        InputError: if it is a saved result, or cannot be read.
    """
    from trainmj.collision.saved import find_result
    from trainmj.files.resources import kind_at

    if find_result(file) is not None:
        raise InputError(f"{file}: is a saved result, for trainmj run, report and render, not an input file")
    return kind_at(file)


def _formats(context: click.Context, parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """The formats of --figures."""
    from trainmj.output.style import formats_given

    return () if text.lower() == "none" else formats_given(parts_of(text.lower()))


def _together(*options: Callable[[F], F]) -> Callable[[F], F]:
    """Several options as one decorator; help lists them in this order."""

    def decorate(function: F) -> F:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


def takes_time(function: F) -> F:
    """A command that may take long: something moves on a terminal until it shows something of its own."""

    @wraps(function)
    def shown(*args: Any, **options: Any) -> Any:
        from trainmj.output.waiting import waiting

        with waiting(str(click.get_current_context().info_name)):
            return function(*args, **options)

    return cast(F, shown)


def say(text: str, err: bool = False) -> None:
    """Print a line, after what moves has gone."""
    from trainmj.output.waiting import hush

    hush()
    click.echo(text, err=err)


def say_notes(notes: Iterable[str]) -> None:
    """Say what there is to know of how files were read, apart from what the command prints."""
    for note in notes:
        say(f"Note: {printable(note)}", err=True)


def say_json(values: Any) -> None:
    """Print one JSON object."""
    say(json.dumps(values, indent=2))


takes_allowed = click.option(
    "--allow-folder",
    multiple=True,
    metavar="DIR",
    expose_value=False,
    is_eager=True,
    callback=_allow,
    help="Let input files name files in this folder and below, too; else only beside them and below. May be repeated.",
)
"""The option --allow-folder, which holds while the command runs."""

takes_changes = _together(
    click.option(
        "--set",
        "changes",
        multiple=True,
        metavar="PATH=VALUE",
        callback=_changes,
        shell_complete=settings,
        help="Change a value: a parameter of the scenario (mass_t=33) or a path (collision.gap_mm=50); null takes it "
        "back. May be repeated.",
    ),
    takes_allowed,
)
"""The option --set, given as a dict of changes, and --allow-folder."""

takes_scenario = _together(click.argument("scenario", shell_complete=offers(SCENARIO, results=True)), takes_changes)
"""The argument SCENARIO and the option --set."""

takes_threads = click.option(
    "--threads",
    type=click.IntRange(0, 1024),
    metavar="N",
    default=0,
    help="Native threads; all cores by default. The numbers do not depend on it.",
)

takes_folder = _together(
    click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for results; made if needed."),
    click.option(
        "--fresh", is_flag=True, help="Start over: remove what this command left in the folder, and nothing else."
    ),
    takes_threads,
)
"""The options --out, --fresh and --threads of commands that go on with what is in their folder."""

takes_formats = click.option(
    "--figures",
    default="png",
    show_default=True,
    metavar="FORMATS",
    callback=_formats,
    help="Formats of figures, such as png,svg,pdf; none for no figures.",
)
"""The option --figures, given as a tuple of formats."""

takes_figures = _together(
    takes_formats,
    click.option(
        "--figure-width",
        type=click.Choice(["column", "page"]),
        default="page",
        show_default=True,
        help="Width of figures: 84 mm or 174 mm, a journal's column or page.",
    ),
)

takes_fail_on_limit = click.option(
    "--fail-on-limit",
    is_flag=True,
    help="Exit code 1 where a limit was passed, a car body gave way, a curve ended behind which nothing is stated, or "
    "one vehicle overrode another.",
)
"""The option --fail-on-limit of commands whose exit code says by default only whether they computed."""

takes_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")


@contextmanager
def going_on(out: Path, fresh: bool, stop: Callable[[], None]) -> Iterator[None]:
    """Work that Ctrl-C stops with exit code 130 and a word on how to go on with it.

    What is finished is in the folder; with --fresh the same command would start over. The progress is stopped first.
    """
    try:
        yield
    except KeyboardInterrupt:
        stop()
        command = "the same command without --fresh" if fresh else "the same command"
        say(f"Stopped. What was finished is in {out}; {command} goes on.", err=True)
        sys.exit(130)
    finally:
        stop()
