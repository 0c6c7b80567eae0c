"""An input file as it was read: plain values, the place of each, and the folder in which it names other files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

from trainmj.errors import InputError
from trainmj.files.problems import Model, Origins, Problem, refuse, said_of, validated
from trainmj.files.resources import find_file
from trainmj.files.yaml import read_yaml


@dataclass(frozen=True)
class Source:
    """Where checked values come from.

    Attributes:
        values: nested dicts, lists, strings and numbers, as a YAML file gives them.
        folder: where files named in it are.
        origins: file, line and column of each value by path; empty for values that are not from a file.
    """

    values: Mapping[str, Any]
    folder: FilePath = FilePath()
    origins: Origins = field(default_factory=dict, repr=False)

    def checked(self, model: type[Model]) -> Model:
        """The values as a model.

        Raises:
            InputError: listing every key and value that is wrong.
        """
        return validated(model, self.values, self.origins)

    def refuse(self, problems: Iterable[Problem]) -> None:
        """Raise an error that lists the problems, if there are any.

        Raises:
            InputError: with the place and value of each.
        """
        listed = list(problems)
        if listed:
            raise refuse(listed, self.values, self.origins)

    def error(self, rule: str, *path: str | int) -> InputError:
        """The error that says what is wrong with a value."""
        return refuse([Problem(path, rule)], self.values, self.origins)

    def said(self, *path: str | int) -> str:
        """Place, key and value, to begin a message with: ``my.yaml:1:1: scenario = 'b_typ'``."""
        return said_of(path, self.values, self.origins)


def read_source(file: str | FilePath, ending: str, what: str) -> Source:
    """Read an input file, or one that ships with trainmj by its name.

    Args:
        file: path of a YAML file, or the name of a shipped one.
        ending: of the names of shipped ones: ``.study.yaml``.
        what: it is, for messages: study.

    Raises:
        InputError: if there is no such file, or it is not a group of keys and values.
    """
    path = find_file(file, ending, what)
    values, origins = read_yaml(path)
    return Source(values, path.parent, origins)
