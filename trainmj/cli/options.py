"""What several commands take: a scenario, and changes of its values."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import click

from trainmj.errors import InputError
from trainmj.files.folder import held

if TYPE_CHECKING:
    from trainmj.scenario import Scenario

F = TypeVar("F", bound=Callable[..., Any])

_SET_HELP = "Change a value: a parameter of the scenario (mass_t=33) or a path (collision.gap_mm=50). May be repeated."


def takes_scenario(function: F) -> F:
    """The argument SCENARIO and the option --set, given as a dict of changes."""
    function = click.option("--set", "changes", multiple=True, metavar="PATH=VALUE", callback=_changes, help=_SET_HELP)(
        function
    )
    return click.argument("scenario")(function)


def takes_formats(function: F) -> F:
    """The option --figures, given as a tuple of formats."""
    return click.option(
        "--figures",
        default="png",
        show_default=True,
        metavar="FORMATS",
        callback=_formats,
        help="Formats of figures, such as png,svg,pdf; none for no figures.",
    )(function)


def takes_figures(function: F) -> F:
    """The options --figures and --figure-width, given as a tuple of formats and a width."""
    function = takes_formats(function)
    return click.option(
        "--figure-width",
        type=click.Choice(["column", "page"]),
        default="page",
        show_default=True,
        help="Width of figures: 84 mm or 174 mm, a journal's column or page.",
    )(function)


takes_threads = click.option(
    "--threads",
    type=click.IntRange(0, 1024),
    metavar="N",
    default=0,
    help="Native threads; all cores by default. The numbers do not depend on it.",
)
"""The option --threads."""


takes_fresh = click.option(
    "--fresh", is_flag=True, help="Start over: remove what this command left in the folder, and nothing else."
)
"""The option --fresh. Without it a command goes on with what is in its folder."""


class Shown(Protocol):
    """What shows on the terminal how a command gets on."""

    def stop(self) -> None:
        """Take it away."""


@contextmanager
def going_on(out: Path, fresh: bool, shown: Shown) -> Iterator[None]:
    """Work that can be stopped and gone on with: on Ctrl-C say how, and end with exit code 130.

    Args:
        out: the folder that keeps what is finished.
        fresh: whether --fresh was given, which would start over again.
        shown: taken away at the end.
    """
    try:
        yield
    except KeyboardInterrupt:
        shown.stop()
        command = "the same command without --fresh" if fresh else "the same command"
        click.echo(f"Stopped. What was finished is in {out}; {command} goes on.", err=True)
        sys.exit(130)
    finally:
        shown.stop()


def load_scenario(scenario: str, changes: dict[str, Any]) -> Scenario:
    """The scenario of a file or name, changed."""
    from trainmj.scenario import load

    return load(scenario, changes)


def holds_folder(out: Path) -> None:
    """Make the folder of --out and hold it until the command ends.

    Raises:
        OutputError: if it cannot be made, or another process writes there.
    """
    click.get_current_context().with_resource(held(out))


def split_assignment(option: str, text: str, example: str) -> tuple[str, str]:
    """Path and value of PATH=VALUE.

    Raises:
        InputError: if one of them is missing.
    """
    path, equals, value = text.partition("=")
    if not (equals and path.strip() and value.strip()):
        raise InputError(f"{option} {text}: must be PATH=VALUE, as in {option} {example}")
    return path.strip(), value.strip()


def _changes(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """The values of --set, read as YAML reads them."""
    if not texts:
        return {}
    from trainmj.files.yaml import read_value

    changes = {}
    for text in texts:
        path, value = split_assignment("--set", text, "mass_t=33")
        changes[path] = read_value(value, f"--set {text}")
    return changes


def _formats(context: click.Context, parameter: click.Parameter, text: str) -> tuple[str, ...]:
    """The formats of --figures."""
    from trainmj.output.style import FORMATS

    names = tuple(dict.fromkeys(name.strip().lower() for name in text.split(",")))
    if names == ("none",):
        return ()
    for name in names:
        if name not in FORMATS:
            raise InputError(f"--figures {text}: {name!r} is not a format of figures; known: {', '.join(FORMATS)}")
    return names
