"""An input file as it was read: plain values, the place of each for messages, and the folder of the file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path as FilePath
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from trainmj.errors import InputError
from trainmj.files.either import keys_of
from trainmj.files.problems import Path, Problem, dotted, from_pydantic

Model = TypeVar("Model", bound=BaseModel)

_SHOWN = 60  # characters of a value in a message
_LONGEST = 300  # characters of a path in a message
_MOST = 20  # problems in one message


@dataclass(frozen=True)
class Source:
    """Plain values, and where they come from.

    Attributes:
        values: nested dicts, lists, strings and numbers, as a YAML file gives them.
        origins: where values stand, by path: ``"my.yaml:12:5"`` or ``"change mass_t=33"``; may be empty.
        folder: where the files that the values name are.
    """

    values: Mapping[str, Any]
    origins: Mapping[Path, str] = field(default_factory=dict, repr=False)
    folder: FilePath = FilePath()

    def checked(self, model: type[Model]) -> Model:
        """The values as a model.

        Raises:
            InputError: listing every key and value that is wrong.
        """
        try:
            return model.model_validate(self.values)
        except ValidationError as error:
            kind, keys = model.model_config.get("title"), keys_of(model)
            if kind and 2 * sum(key in keys for key in self.values) < len(self.values):
                needed = ", ".join(key for key, field in keys.items() if field.is_required())
                rule = f"is not a {kind}, which states {needed}"
                raise InputError(f"{self.origins[()]}: {rule}" if () in self.origins else rule) from None
            raise self.refusal(from_pydantic(error, model)) from None

    def refuse(self, problems: Iterable[Problem]) -> None:
        """Raise the error that lists problems, if there are any.

        Raises:
            InputError: with the place and value of each.
        """
        listed = list(islice(problems, _MOST + 1))
        if listed:
            raise self.refusal(listed)

    def refusal(self, problems: Iterable[Problem]) -> InputError:
        """The error that lists problems, each with its place and value."""
        listed = list(islice(problems, _MOST + 1))
        lines = [f"{self.said(*problem.path)}: {problem.rule}" for problem in listed[:_MOST]]
        return InputError("\n".join(lines + ["and more"] * (len(listed) > _MOST)))

    def error(self, rule: str, *path: str | int) -> InputError:
        """The error that says what is wrong with a value."""
        return self.refusal([Problem(path, rule)])

    def said(self, *path: str | int) -> str:
        """Place, key and value, to begin a message with: ``my.yaml:1:1: scenario = 'b_typ'``."""
        origin = next((self.origins[path[:n]] for n in range(len(path), -1, -1) if path[:n] in self.origins), "")
        value: Any = self.values
        try:
            for key in path:
                value = value[key]
            text = "" if isinstance(value, (dict, list)) else ascii(value)
        except (KeyError, IndexError, TypeError):
            text = ""
        shown = f" = {text[:_SHOWN]}{'...' if len(text) > _SHOWN else ''}" if text else ""
        return f"{f'{origin}: ' if origin else ''}{dotted(path)[:_LONGEST] or 'file'}{shown}"
