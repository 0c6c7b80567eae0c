"""From a folder of results to its report: what it holds is seen from its files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from trainmj.errors import InputError
from trainmj.files.text import printable

if TYPE_CHECKING:
    from trainmj.collision.result import Result
    from trainmj.collision.summary import Summary
    from trainmj.output.page import Page

REPORT = "report.html"


def write_report(results: str | Path, out: str | Path | None = None) -> Path:
    """Write the report of a run, a sweep or a study.

    Args:
        results: its folder, or a file in it: result.nc (or another saved result), results.sqlite, steps.json.
        out: the HTML file; by default report.html in the folder, and case_3.html for a result case_3.nc.

    Returns:
        The file.

    Raises:
        InputError: if there are no results, or of several kinds, or they are damaged or unfinished.
        OutputError: if the file cannot be written.
    """
    source = _source(Path(results))
    name = REPORT if source.name in _KINDS else f"{source.stem}.html"
    file = source.with_name(name) if out is None else Path(out)
    _page(source).write(file)
    return file


def write_run_report(result: Result, summary: Summary, folder: Path) -> Path:
    """Write the report of a collision that has just been computed and saved, without reading it again.

    Args:
        result: of the collision.
        summary: of the result.
        folder: of the run.

    Raises:
        OutputError: if the file cannot be written.
    """
    from trainmj.single.page import page_of_run

    page_of_run(result, summary, folder / "result.nc").write(folder / REPORT)
    return folder / REPORT


def _page(source: Path) -> Page:
    try:
        return _KINDS.get(source.name, ("run", _run))[1](source)
    except InputError:
        raise
    except _DAMAGED as error:
        said = printable(f"{type(error).__name__}: {error}")[:200]
        raise InputError(
            f"{source.parent}: a file here is damaged or was changed by hand ({said}): make the results again"
        ) from error


def _run(source: Path) -> Page:
    from trainmj.single.page import page_of_file

    return page_of_file(source)


def _sweep(source: Path) -> Page:
    from trainmj.sweep.page import page_of_folder

    return page_of_folder(source.parent)


def _study(source: Path) -> Page:
    from trainmj.study.page import page_of_folder

    return page_of_folder(source.parent)


_KINDS: dict[str, tuple[str, Callable[[Path], Page]]] = {
    "result.nc": ("run", _run),
    "results.sqlite": ("sweep", _sweep),
    "steps.json": ("study", _study),
}
"""The file by which each kind of results is known."""

_OTHERS = {
    "trials.sqlite": "an identification: its report is made by trainmj identify TARGETS --out {folder} --resume "
    "--report, which simulates nothing again",
    "paper.html": "a reproduction of the paper: its report is paper.html, made by trainmj paper --out {folder}",
}
"""Files by which results are known whose own command makes their report."""

_DAMAGED = (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError)
"""What numbers and words that are not as trainmj wrote them lead to."""


def _source(results: Path) -> Path:
    """The file that holds the results, or tells what they are."""
    if results.is_file():
        if results.name in _KINDS or results.suffix == ".nc":
            return results
        raise InputError(f"{results}: is no result: give the folder of a run, a sweep or a study, or a result (.nc)")
    if not results.exists():
        raise InputError(f"{results}: there is no such folder")
    there = [results / name for name in _KINDS if (results / name).is_file()]
    for name, what in _OTHERS.items():
        if not there and (results / name).is_file():
            raise InputError(f"{results}: holds {what.format(folder=quote(str(results)))}")
    if not there:
        known = ", ".join(f"{name} ({kind})" for name, (kind, _) in _KINDS.items())
        raise InputError(f"{results}: holds no run, sweep or study: there is none of {known}")
    if len(there) > 1:
        kinds = " and ".join(f"a {_KINDS[file.name][0]}" for file in there)
        raise InputError(f"{results}: holds {kinds}: name one of them, as in trainmj report {there[0]}")
    return there[0]
