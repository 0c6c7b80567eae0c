"""The command report, which finds out what a folder holds; and the option --report of commands that make results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import date
from functools import wraps
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast

import click

from trainmj.cli.completing import offers
from trainmj.cli.options import say, takes_time
from trainmj.errors import InputError
from trainmj.files.arguments import group_given, path_given
from trainmj.files.folder import is_held, spare
from trainmj.files.text import printable

if TYPE_CHECKING:
    from trainmj.collision.result import Result
    from trainmj.files.cover import Cover
    from trainmj.output.page import Page

F = TypeVar("F", bound=Callable[..., Any])

_COVER = {
    "project": "the project that it is part of",
    "client": "whom it is for",
    "author": "who answers for it",
    "revision": "its revision",
    "date": "its date as it is to be read; today takes that of the clock",
}
"""What heads a report, as options of commands; see :class:`trainmj.files.cover.Cover`."""


class _OfHead(click.Option):
    """One of the options of what heads a report; help lists them as one."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        if self.name != next(iter(_COVER)):
            return None
        said = "Head of the report, each a line of text; --date today takes the date of the clock."
        return f"{', '.join(f'--{name}' for name in _COVER)} TEXT", said


def takes_cover(function: F) -> F:
    """The options of what heads a report, given as the Cover ``cover``; they go before what the scenario states."""

    @wraps(function)
    def with_cover(**values: Any) -> Any:
        return function(cover=cover_given({name: values.pop(name) for name in _COVER}), **values)

    for name, said in reversed(_COVER.items()):
        with_cover = click.option(f"--{name}", metavar="TEXT", cls=_OfHead, help=f"At the head of the report: {said}.")(
            with_cover
        )
    return cast(F, with_cover)


def takes_report(function: F) -> F:
    """The option --report and those of its head, given as the Cover ``cover``; None without --report."""

    @wraps(function)
    def if_asked(with_report: bool, cover: Cover, **values: Any) -> Any:
        if not with_report and cover.stated:
            raise InputError(f"--{next(iter(cover.stated))}: needs --report, whose page it heads")
        return function(cover=cover if with_report else None, **values)

    said = "Write report.html too: all results on one page, in one file."
    return click.option("--report", "with_report", is_flag=True, help=said)(takes_cover(cast(F, if_asked)))


def cover_given(values: Mapping[str, str | None]) -> Cover:
    """What heads a report, as it is given; None stands for nothing, and the date today for that of the clock.

    Raises:
        InputError: if there is no such value, or one is more than a line.
    """
    from trainmj.files.cover import TODAY, Cover
    from trainmj.files.source import source_of

    stated = {name: text for name, text in group_given(values).items() if text is not None}
    if str(stated.get("date", "")).strip().lower() == TODAY:
        stated["date"] = date.today().isoformat()
    return source_of(stated).checked(Cover)


class Kind(NamedTuple):
    """What a folder may hold."""

    name: str  # of what made it
    file: str  # by which it is known
    page: Callable[[Path], Page] | None = None  # makes the report from the file; None if only the command can make it
    cure: str = ""  # how the command makes the report


_AGAIN = ", which computes nothing again"


def kinds() -> tuple[Kind, ...]:
    """All kinds of results."""
    from trainmj.assessment import folder as assessment
    from trainmj.cases import store
    from trainmj.collision import saved
    from trainmj.comparison import folder as comparison
    from trainmj.identification import run as identification
    from trainmj.paper import BEYOND, PAGE
    from trainmj.reliability import run as reliability
    from trainmj.study import folder as study

    return (
        Kind("a run", saved.FILE, _page_of_run),
        Kind("a sweep", store.FILE, _page_of_sweep),
        Kind("a study", study.STATE, _page_of_study),
        Kind(
            "an identification", identification.FILE, cure=f"trainmj identify TARGETS --out {{folder}} --report{_AGAIN}"
        ),
        Kind("an assessment", assessment.FILE, cure="trainmj assess TRAIN --standard NAME --out {folder} --report"),
        Kind("a reliability run", reliability.FILE, cure=f"trainmj reliability FILE --out {{folder}} --report{_AGAIN}"),
        Kind("a comparison", comparison.FILE, cure="trainmj compare A B --out {folder} --report"),
        Kind("a reproduction of the paper", PAGE, cure=f"trainmj paper --out {{folder}}{_AGAIN}"),
        Kind("the paper's laws beyond its range", BEYOND, cure="trainmj paper --beyond --out {folder}"),
    )


def _page_of_run(file: Path) -> Page:
    from trainmj.single.page import page_of_file

    return page_of_file(file)


def _page_of_sweep(file: Path) -> Page:
    from trainmj.sweep.page import page_of_folder

    return page_of_folder(file.parent)


def _page_of_study(file: Path) -> Page:
    from trainmj.study.page import page_of_folder

    return page_of_folder(file.parent)


@click.command()
@click.argument("results", type=click.Path(path_type=Path), shell_complete=offers(results=True))
@click.option("--out", type=click.Path(path_type=Path), help="HTML file to write; report.html in the folder otherwise.")
@takes_cover
@takes_time
def report(results: Path, out: Path | None, cover: Cover) -> None:
    """Write the report of a run, a sweep or a study.

    RESULTS is the folder that the command wrote, or one saved result in it, such as case_3.nc. The report is one HTML
    file that opens by double click and needs no network: tables, plots with zoom and read-out, and for a run the
    collision as an animation.
    """
    write(results, cover, out)


def write(results: Path, cover: Cover, out: Path | None = None, silent: bool = False) -> None:
    """Write a report and say where, unless silent."""
    file = write_report(results, out, cover.stated)
    if not silent:
        say(f"Report: {file}")


def write_report(
    results: str | Path | Result, out: str | Path | None = None, cover: Mapping[str, str | None] | None = None
) -> Path:
    """Write the report of a run, a sweep or a study.

    Args:
        results: its folder, or a file in it: result.nc (or another saved result), results.sqlite, steps.json; or what
            run, run_sweep or run_study gave.
        out: the HTML file; by default report.html in the folder, and case_3.html for a result case_3.nc; of a result
            that was not saved, report.html in the working directory.
        cover: what heads it, before what the scenario states: project, client, author, revision, date.

    Returns:
        The file.

    Raises:
        InputError: if there are no results, or results of several kinds, or damaged or unfinished ones, or the cover
            is wrong.
        OutputError: if the file cannot be written.
    """
    from trainmj.collision.result import Result
    from trainmj.output.page import REPORT

    given = cover_given(cover or {})
    if isinstance(results, Result):
        from trainmj.collision.summary import summarise
        from trainmj.single.page import page_of_run

        file = Path(REPORT if out is None else out)
        page_of_run(results, summarise(results)).headed(given).write(file)
        return file
    results = path_given(results)
    kind, source = what_is_at(results)
    if kind.page is None:
        cure = kind.cure.format(folder=quote(str(source.parent)))
        raise InputError(f"{results}: holds {kind.name}: its report is made by {cure}")
    name = REPORT if source.name == kind.file else f"{source.stem}.html"
    file = source.with_name(name) if out is None else Path(out)
    spare([source], file)
    try:
        page = kind.page(source)
    except _DAMAGED as error:
        if is_held(source.parent):
            raise InputError(f"{source.parent}: another trainmj is writing to this folder: wait for it") from error
        if isinstance(error, InputError):
            raise
        said = printable(f"{type(error).__name__}: {error}")[:200]
        raise InputError(
            f"{source.parent}: a file here is damaged or was changed by hand ({said}): make the results again"
        ) from error
    page.headed(given).write(file)
    return file


_DAMAGED = (ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError)
"""What is raised by values that trainmj did not write."""


def holds_results(file: str) -> bool:
    """Whether a path leads to a saved result, or to a folder that has results of some kind."""
    path = Path(file)
    try:
        return path.suffix == ".nc" or (path.is_dir() and any((path / kind.file).is_file() for kind in kinds()))
    except (OSError, ValueError):
        return False


def what_is_at(results: Path) -> tuple[Kind, Path]:
    """What a path leads to, and the file that holds it."""
    known = kinds()
    if results.is_file():
        for kind in known:
            if results.name == kind.file or (kind is known[0] and results.suffix == ".nc"):
                return kind, results
        raise InputError(f"{results}: is not a result: give the folder of a run, sweep or study, or a result (.nc)")
    if not results.exists():
        raise InputError(f"{results}: there is no such folder")
    there = [kind for kind in known if (results / kind.file).is_file()]
    if not there:
        files = ", ".join(f"{kind.file} ({kind.name})" for kind in known)
        raise InputError(f"{results}: holds no results: none of the files {files} is there")
    if len(there) > 1:
        names = " and ".join(kind.name for kind in there)
        raise InputError(f"{results}: holds {names}: name one, as in trainmj report {results / there[0].file}")
    return there[0], results / there[0].file
