"""The command line: ``trainmj run b_type --set speed_km_h=25 --out results``.

Heavy imports come late, inside the commands, so that help answers at once.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

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
from trainmj.errors import InputError, TrainmjError, out_of_memory
from trainmj.files import memory
from trainmj.files.text import printable

PATIENCE = 10.0
"""How long a command has for its end, once it is interrupted, before a further interruption breaks it off [s]."""


_ENDING = (KeyboardInterrupt, GeneratorExit, SystemExit)
"""What is being handled while an interrupted command comes to its end."""


@contextmanager
def _ends_as_interrupted(alone: bool) -> Iterator[None]:
    """Let SIGTERM, and SIGHUP unless it is ignored, stop a command as Ctrl-C does, with exit code 128 and their number.

    Batch systems and closed terminals send them; what is finished is written. One that comes again while the command
    ends does not disturb that, for native threads may still be at work; after PATIENCE it ends the process at once.
    alone says that the process does nothing else: then this lasts until it is gone.
    """
    came: list[tuple[int, float]] = []

    def stop(number: int, frame: Any) -> None:
        interrupted = signal.getsignal(signal.SIGINT)
        if interrupted not in (stop, signal.SIG_IGN) and callable(interrupted):  # holds it back for a while
            interrupted(number, frame)
            return
        if came and isinstance(sys.exc_info()[1], _ENDING):
            if time.monotonic() - came[0][1] > PATIENCE:
                os._exit(128 + number)  # as safe as kill -9
            return
        came.append((number, time.monotonic()))
        raise KeyboardInterrupt  # again, too: some packages lose one that comes while they are imported

    allowed = threading.current_thread() is threading.main_thread()
    own = {signal.SIGINT: signal.default_int_handler}
    own |= {getattr(signal, name): signal.SIG_DFL for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)}
    changed = {number: before for number, before in own.items() if allowed and signal.getsignal(number) is before}
    for number in changed:
        signal.signal(number, stop)
    try:
        yield
    except SystemExit as end:
        raise SystemExit(128 + came[0][0]) if came and end.code == 130 else end from None
    except Exception:
        if not came:
            raise
        click.echo("Stopped.", err=True)  # an interruption while a package is imported can come out as its own error
        raise SystemExit(128 + came[0][0]) from None
    finally:
        for number, before in changed.items():
            over = alone and (came or number == signal.SIGINT)  # a late Ctrl-C would be a traceback of Python's
            signal.signal(number, signal.SIG_IGN if over else before)


class _Group(click.Group):
    """Errors that trainmj raises on purpose end in one message and exit code 2, never in a traceback."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)  # as they are added, not by the alphabet

    _alone = False  # in its process

    def __call__(self, *args: Any, **options: Any) -> Any:
        """Run as a program: MuJoCo's windows and pydantic's plugins would take longer to find than a collision."""
        gc.set_threshold(100_000)  # what is imported stays: looking for garbage in it takes a twentieth of a short run
        os.environ.setdefault("MUJOCO_GL", "disable")
        os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
        return super().__call__(*args, **options)

    def main(self, args: Sequence[str] | None = None, *more: Any, **options: Any) -> Any:
        self._alone = args is None
        streams.prepare()
        return super().main(args, *more, **options)

    def make_context(self, *args: Any, **options: Any) -> click.Context:
        with _told():
            return super().make_context(*args, **options)

    def invoke(self, ctx: click.Context) -> Any:
        from trainmj.output.style import without_settings

        without_settings()
        with _ends_as_interrupted(self._alone), _told():
            _check_place()
            return super().invoke(ctx)


def _check_place() -> None:
    try:
        os.getcwd()
    except OSError as error:
        raise InputError(f"the current folder cannot be used ({error.strerror}): change to another one") from None


@contextmanager
def _told() -> Iterator[None]:
    """Say what ends a command, before click does in its way."""
    try:
        yield
    except TrainmjError as error:
        _end(str(error))
    except KeyboardInterrupt:
        click.echo("Stopped.", err=True)
        sys.exit(130)
    except EOFError as error:
        raise RuntimeError(f"EOFError: {error}") from error  # click would take it for Ctrl-C
    except Exception as error:
        if not out_of_memory(error):
            raise
        _end(memory.lacking())


def _end(message: str) -> NoReturn:
    """End with an error."""
    coloured = not os.environ.get("NO_COLOR")  # and only on a terminal
    click.echo(click.style("Error:", fg="red", bold=True) if coloured else "Error:", err=True, nl=False)
    click.echo(f" {printable(message)}", err=True)
    sys.exit(2)


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
    if command.callback and command not in (inputs.scenarios, completion):  # which load no library of numbers
        command.callback = memory.checked(command.callback)
    main.add_command(command)
