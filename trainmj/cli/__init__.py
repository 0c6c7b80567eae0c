"""The command line: ``trainmj run b_type --set speed_km_h=25 --out results``.

Heavy imports come late, inside the commands, so that help answers at once.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from trainmj.cli import collision, inputs, references, streams, tasks
from trainmj.cli.assess import assess
from trainmj.cli.compare import compare
from trainmj.cli.completing import completion
from trainmj.cli.explore import explore
from trainmj.cli.export import export
from trainmj.cli.new import new
from trainmj.cli.reliability import reliability
from trainmj.cli.render import render, view
from trainmj.cli.report import report
from trainmj.errors import TrainmjError
from trainmj.files.text import printable


@contextmanager
def _ends_as_interrupted() -> Iterator[None]:
    """Let SIGTERM, and SIGHUP unless it is ignored, stop a command as Ctrl-C does, with exit code 128 and their number.

    Batch systems and closed terminals send them; what is finished is written.
    """
    came: list[int] = []

    def stop(number: int, frame: Any) -> None:
        came.append(number)
        interrupted = signal.getsignal(signal.SIGINT)  # may hold it back for a while
        if not callable(interrupted):  # ignored, as in a job in the background
            raise KeyboardInterrupt
        interrupted(signal.SIGINT, frame)

    allowed = threading.current_thread() is threading.main_thread()
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if allowed and hasattr(signal, name)]
    changed = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]
    for number in changed:
        signal.signal(number, stop)
    try:
        yield
    except SystemExit as end:
        raise SystemExit(128 + came[0]) if came and end.code == 130 else end from None
    finally:
        for number in changed:
            signal.signal(number, signal.SIG_DFL)


class _Group(click.Group):
    """Errors that trainmj raises on purpose end in one message and exit code 2, never in a traceback."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)  # as they are added, not by the alphabet

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Run as a program: MuJoCo's windows and pydantic's plugins would take longer to find than a collision."""
        gc.set_threshold(100_000)  # what is imported stays: looking for garbage in it takes a twentieth of a short run
        os.environ.setdefault("MUJOCO_GL", "disable")
        os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
        return super().__call__(*args, **options)

    def main(self, *args: Any, **options: Any) -> Any:
        streams.prepare()
        return super().main(*args, **options)

    def make_context(self, *args: Any, **options: Any) -> click.Context:
        with _told():
            return super().make_context(*args, **options)

    def invoke(self, ctx: click.Context) -> Any:
        from trainmj.output.style import without_settings

        without_settings()
        with _ends_as_interrupted(), _told():
            return super().invoke(ctx)


@contextmanager
def _told() -> Iterator[None]:
    """Say what ends a command, before click does in its way."""
    try:
        yield
    except TrainmjError as error:
        coloured = not os.environ.get("NO_COLOR")  # and only on a terminal
        click.echo(click.style("Error:", fg="red", bold=True) if coloured else "Error:", err=True, nl=False)
        click.echo(f" {printable(str(error))}", err=True)
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
    new,
    collision.run,
    inputs.check,
    inputs.scenarios,
    inputs.schema,
    tasks.sweep,
    tasks.study,
    tasks.identify,
    assess,
    reliability,
    compare,
    report,
    explore,
    render,
    view,
    export,
    references.verify,
    references.paper,
    completion,
):
    main.add_command(command)
