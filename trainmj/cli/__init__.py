"""The command line: ``trainmj run b_type --set speed_km_h=25 --out results``.

Heavy imports come late, inside the commands, so that help answers at once.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from trainmj.cli import collision, inputs, references, streams, tasks
from trainmj.cli.render import render, view
from trainmj.cli.report import report
from trainmj.errors import TrainmjError
from trainmj.files.text import printable
from trainmj.output.style import without_settings


class _Group(click.Group):
    """Errors that trainmj raises on purpose end in one message and exit code 2, never in a traceback."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)  # as they are added, not by the alphabet

    def main(self, *args: Any, **options: Any) -> Any:
        streams.prepare()
        without_settings()
        return super().main(*args, **options)

    def make_context(self, *args: Any, **options: Any) -> click.Context:
        with _told():
            return super().make_context(*args, **options)

    def invoke(self, ctx: click.Context) -> Any:
        with _told():
            return super().invoke(ctx)


@contextmanager
def _told() -> Iterator[None]:
    """Say what ends a command, before click does in its way."""
    try:
        yield
    except TrainmjError as error:
        click.echo(f"Error: {printable(str(error))}", err=True)
        sys.exit(2)
    except KeyboardInterrupt:
        click.echo("Stopped.", err=True)
        sys.exit(130)
    except EOFError as error:
        raise RuntimeError(f"EOFError: {error}") from error  # click would take it for Ctrl-C


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="trainmj")
def main() -> None:
    """Train collisions on a straight track, computed with MuJoCo.

    SCENARIO is a YAML file, or the name of one that ships with trainmj: see `trainmj scenarios`.
    """


for command in (
    collision.run,
    collision.check,
    inputs.scenarios,
    inputs.schema,
    tasks.sweep,
    tasks.study,
    tasks.identify,
    report,
    render,
    view,
    collision.export,
    references.verify,
    references.paper,
):
    main.add_command(command)
