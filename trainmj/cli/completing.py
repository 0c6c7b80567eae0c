"""What a shell offers to complete: names of files that ship, parameters and paths of a scenario, folders of results.

The shell waits for it at every press of a key, so it imports no more than it needs: YAML is read without its checks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem, get_completion_class

from trainmj.errors import InputError, TrainmjError
from trainmj.files.kinds import ASSESSMENT, PARTNER, RELIABILITY, SCENARIO, STUDY, SWEEP, TARGETS, Kind

Offered = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]

RESULTS = ("result.nc", "results.sqlite", "steps.json")
"""Files by which a folder with a report is known."""

SHELLS = ("bash", "zsh", "fish")
_MOST_BYTES = 1_000_000  # of a file that is looked into
_MOST_FOLDERS = 500
_LONGEST_CHAIN = 10  # of scenarios that build on each other
_READ_BY = ("scenario", "train", "file", "study", "targets", "standard")  # arguments that are an input file


def offers(*kinds: Kind, results: bool = False) -> Offered:
    """Names of shipped files of some kinds, and folders with results here if wanted; any file, where none fits."""

    def offered(context: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
        from trainmj.files.resources import shipped_files

        ambiguous = len(kinds) > 1  # a scenario and a study may have the same name
        names = [
            name if kind is SCENARIO or not ambiguous else f"{name}{kind.ending}"
            for kind in kinds
            for name in shipped_files(kind.ending)
        ]
        names += _folders() if results else []
        files = CompletionItem(begun, type="file")  # first: a shell then still adds the names
        return [files, *(CompletionItem(name) for name in dict.fromkeys(names) if name.startswith(begun))]

    return offered


def _folders() -> list[str]:
    """Folders here that have results."""
    try:
        there = sorted(Path().iterdir())[:_MOST_FOLDERS]
        return [f.name for f in there if any((f / name).is_file() for name in RESULTS)]
    except OSError:
        return []


def settings(context: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """Parameters and paths of the scenario on the line that have one value, each with the present one to change."""
    words = [context.params.get(name) for name in _READ_BY] + [word for word in context.args if word[:1] != "-"]
    file = next(filter(None, words), None)  # an option without a value leaves the words before it unread
    try:
        values = _values(str(file)) if file else {}
    except (OSError, TrainmjError, ValueError):
        return []
    found = dict(_scalars(values))
    parameters = values.get("parameters")
    firsts = {
        name: path.strip("[] ").split(",")[0].strip()
        for name, path in (parameters.items() if isinstance(parameters, dict) else ())
        if isinstance(path, str)
    }
    items = [(name, found.get(path, ""), path) for name, path in firsts.items()]
    items += [(path, value, "") for path, value in found.items()]
    return [
        CompletionItem(f"{name}={value}", help=path or None)
        for name, value, path in items
        if f"{name}=".startswith(begun)
    ]


def _values(file: str, depth: int = 0) -> dict[str, Any]:
    """The values of a scenario with those that it builds on; of another file, those of the scenario that it names."""
    from trainmj.files.resources import find_file

    endings = (SCENARIO, SWEEP, STUDY, TARGETS, RELIABILITY, ASSESSMENT, PARTNER)
    for kind in endings:
        try:
            path = find_file(file, kind.ending, "scenario")
            break
        except InputError:
            continue
    else:
        return {}
    if path.stat().st_size > _MOST_BYTES or depth > _LONGEST_CHAIN:
        return {}
    values = _groups(path.read_text(encoding="utf-8-sig").splitlines())
    below = values.pop("builds_on", None) or ("" if "devices" in values else values.get("scenario"))
    if not isinstance(below, str) or not below:
        return values
    beside = path.with_name(below)
    under = _values(str(beside) if beside.is_file() else below, depth + 1)
    return _over(under, values) if "scenario" not in values else under


def _over(under: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """Values laid over others, group by group."""
    merged = dict(under)
    for key, value in values.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _over(merged[key], value) if both else value
    return merged


def _groups(lines: list[str]) -> dict[str, Any]:
    """The groups of a YAML file that are written in lines of their own, without its checks; values as they stand."""
    values: dict[str, Any] = {}
    within: list[tuple[int, dict[str, Any]]] = [(-1, values)]
    skipped = -1  # lines further in than this go on with a value that is no group
    for line in lines:
        found = _LINE.fullmatch(line)
        indent = len(line) - len(line.lstrip())
        if not line.strip() or line.lstrip().startswith("#") or -1 < skipped < indent:
            continue
        skipped = -1
        if found is None:
            skipped = indent
            continue
        while within[-1][0] >= indent:
            within.pop()
        key, value = found["key"], found["value"].strip()
        if value:
            within[-1][1][key], skipped = value.strip("\"'"), indent
        else:
            group: dict[str, Any] = {}
            within[-1][1][key] = group
            within.append((indent, group))
    return values


_LINE = re.compile(r"\s*(?P<key>[\w.]+):(?P<value>(?: (?:[^#]|(?<! )#)*)?)(?:#.*)?")


def _scalars(values: dict[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
    """Every path that leads to one value."""
    for key, value in values.items():
        at = f"{path}.{key}" if path else key
        if isinstance(value, dict):
            yield from _scalars(value, at) if at not in _NO_SETTINGS else ()
        elif at not in _NO_SETTINGS and value[:1] not in _NO_SCALAR and value not in ("null", "~"):
            yield at, value


_NO_SETTINGS = ("title", "notes", "report", "sources", "parameters", "tolerances")
_NO_SCALAR = ("{", "[", "&", "*", "|", ">", "!")


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
def completion(shell: str) -> None:
    """Print what makes a shell complete commands, options, scenarios, parameters and folders.

    For bash add to ~/.bashrc:  eval "$(trainmj completion bash)"

    For zsh add to ~/.zshrc:  eval "$(trainmj completion zsh)"

    For fish:  trainmj completion fish > ~/.config/fish/completions/trainmj.fish
    """
    root = click.get_current_context().find_root()
    made: Any = get_completion_class(shell)
    click.echo(made(root.command, {}, "trainmj", "_TRAINMJ_COMPLETE").source())
