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
    except (AttributeError, OSError, TrainmjError, TypeError, ValueError):
        return []
    found = dict(_scalars(values))
    parameters = {}
    for name, paths in values.get("parameters", {}).items():
        first = paths if isinstance(paths, str) else next(iter(paths), "")
        parameters[name] = (found.get(first), first)
    items = [(name, value, path) for name, (value, path) in parameters.items()]
    items += [(path, value, "") for path, value in found.items()]
    return [
        CompletionItem(f"{name}={'' if value is None else value}", help=path or None)
        for name, value, path in items
        if f"{name}=".startswith(begun)
    ]


def _values(file: str, depth: int = 0) -> dict[str, Any]:
    """The values of a scenario with those that it builds on; of another file, those of the scenario that it names."""
    from ruamel.yaml import YAML

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
    try:
        read = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8-sig"))
    except Exception as error:  # of the YAML package: whatever is wrong with the file, a shell has nothing to say
        raise ValueError from error
    values: dict[str, Any] = dict(read)
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


def _scalars(values: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every path that leads to one value."""
    skipped = ("title", "notes", "sources", "parameters", "tolerances") if not path else ()
    pairs: Any = values.items() if isinstance(values, dict) else ()
    if isinstance(values, list) and any(isinstance(value, dict) for value in values):
        groups = [(k, value) for k, value in enumerate(values) if isinstance(value, dict)]
        names = [str(value.get("name", k)) for k, value in groups]
        pairs = ((name if names.count(name) == 1 else k, value) for name, (k, value) in zip(names, groups, strict=True))
    for key, value in pairs:
        at = f"{path}.{key}" if path else str(key)
        if key in skipped or (key == "name" and path) or not re.fullmatch(r"[\w.]+", str(key)):
            continue
        if isinstance(value, (dict, list)):
            yield from _scalars(value, at)
        elif value is not None:
            yield at, str(value).lower() if isinstance(value, bool) else value


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
