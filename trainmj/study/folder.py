"""The folder of a study: each step's tables and figures, and what they were made from.

A step is done if its inputs are those of last time and its files are as it left them. Files are replaced whole, so
whatever stops a study leaves either the old or the new one.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from trainmj.collision.identity import identity
from trainmj.errors import InputError, OutputError
from trainmj.files.atomic import write_bytes
from trainmj.files.tables import read_back
from trainmj.output.style import Format, Width, encode, styled

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

V = TypeVar("V")
Tables = Mapping[str, "pd.DataFrame"]
"""Tables of a step by file name without ending."""

STATE = "steps.json"
_KEYS = {"fingerprint": str, "files": dict, "facts": dict, "figures": list}


@dataclass(frozen=True)
class Output(Generic[V]):
    """What a step makes.

    Attributes:
        value: what it hands on to later steps.
        tables: by file name without ending.
        facts: numbers and words for the summary, JSON only.
        figures: by file name without ending; drawn when the tables are written.
    """

    value: V
    tables: Tables
    facts: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, Callable[[], Figure]] = field(default_factory=dict)


@dataclass(frozen=True)
class Step(Generic[V]):
    """A step that is done.

    Attributes:
        name: of the step.
        tables: by file name without ending, as made or as read back, equal to the last digit.
        facts: for the summary.
        digest: changes with anything in the tables; what depends on the step depends on this.
        computed: whether it was done now; otherwise it was there.
        seconds: what it took now.
        get: gives its value, as made or as read back from its tables.
    """

    name: str
    tables: Tables
    facts: Mapping[str, Any]
    digest: str
    computed: bool
    seconds: float
    get: Callable[[], V] = field(repr=False)

    @cached_property
    def value(self) -> V:
        """What it hands on to later steps."""
        return self.get()


class Folder:
    """The files of a study.

    Args:
        path: that is there.
        figures: formats in which figures are drawn; none for no figures.
        width: of figures.
    """

    def __init__(self, path: Path, figures: Sequence[Format] = ("png",), width: Width = "page") -> None:
        """See what is in it."""
        self.path = path
        self._figures = list(figures)
        self._width = width
        self._drawn = [width, *figures] if figures else []
        self.steps: list[Step[Any]] = []
        self._state = self._read_state()

    def step(self, name: str, inputs: Any, make: Callable[[], Output[V]], read: Callable[[Tables], V]) -> Step[V]:
        """Give a step's output: as it is in the folder if it was made from these inputs, otherwise made now.

        Args:
            name: of the step.
            inputs: all that it depends on, as JSON can hold it.
            make: does the work.
            read: gives the value that the work would give, from the tables that it left.
        """
        began = time.monotonic()
        fingerprint = _digest(json.dumps([name, identity(), inputs], default=str).encode())
        done = self._done(name, fingerprint, read)
        if done is None:
            output = make()
            files = self._write(output)
            self._forget(name, files)
            values = (fingerprint, files, dict(output.facts), self._drawn)
            self._state[name] = dict(zip(_KEYS, values, strict=True))
            self._write_state()
            digest = _digest(json.dumps([files[f"{t}.csv"] for t in output.tables]).encode())
            seconds = time.monotonic() - began
            done = Step(name, output.tables, output.facts, digest, True, seconds, lambda: output.value)
        self.steps.append(done)
        return done

    def start_over(self) -> None:
        """Take away the files of all steps, unless somebody has changed them."""
        for name in self._state:
            self._forget(name, {})
        self._state = {}

    def finish(self) -> None:
        """Take away the files of steps that the study no longer has, unless somebody has changed them."""
        for name in set(self._state) - {step.name for step in self.steps}:
            self._forget(name, {})
            del self._state[name]
        self._write_state()

    def write(self, name: str, content: bytes) -> str:
        """Replace a file whole and give the digest of its content.

        Raises:
            OutputError: if it cannot be written.
        """
        file = self.path / name
        try:
            write_bytes(file, content)
        except OutputError as error:
            raise OutputError(f"{error}; finished steps are kept") from None
        return _digest(content)

    def _done(self, name: str, fingerprint: str, read: Callable[[Tables], V]) -> Step[V] | None:
        """The step as the folder has it; None if it must be made."""
        there = self._state.get(name)
        if there is None or there["fingerprint"] != fingerprint or (self._figures and self._drawn != there["figures"]):
            return None
        files: dict[str, str] = there["files"]
        if any(self._digest_of(file) != digest for file, digest in files.items()):
            return None
        names = [file for file in files if file.endswith(".csv")]
        tables = {name.removesuffix(".csv"): read_back(self.path / name) for name in names}
        digest = _digest(json.dumps([files[n] for n in names]).encode())
        return Step(name, tables, there["facts"], digest, False, 0.0, lambda: read(tables))

    def _write(self, output: Output[V]) -> dict[str, str]:
        files = {
            f"{name}.csv": self.write(f"{name}.csv", table.to_csv(index=False).encode())
            for name, table in output.tables.items()
        }
        for name, draw in output.figures.items() if self._figures else ():
            with styled(self._width):
                picture = draw()
            for form in self._figures:
                files[f"{name}.{form}"] = self.write(f"{name}.{form}", encode(picture, form))
        return files

    def _forget(self, name: str, kept: Mapping[str, str]) -> None:
        """Take away the files that a step left and no longer makes, unless somebody has changed them."""
        for file, digest in self._state.get(name, {}).get("files", {}).items():
            if file not in kept and self._digest_of(file) == digest:
                (self.path / file).unlink()

    def _digest_of(self, file: str) -> str:
        try:
            return _digest((self.path / file).read_bytes())
        except OSError:
            return ""

    def _read_state(self) -> dict[str, Any]:
        """What the folder says of its steps; nothing if it says nothing that trainmj writes.

        Raises:
            InputError: if it names a file outside the folder.
        """
        try:
            said = json.loads((self.path / STATE).read_text(encoding="utf-8"))
            state = {
                name: step
                for name, step in said.items()
                if set(step) == set(_KEYS) and all(isinstance(step[key], kind) for key, kind in _KEYS.items())
            }
            files = [Path(file) for step in state.values() for file in step["files"]]
        except (OSError, ValueError, AttributeError, TypeError):
            return {}
        for file in files:
            if file.name != str(file):
                raise InputError(
                    f"{self.path / STATE}: names the file {str(file)!a}, which is not a plain name: remove it"
                )
        return state

    def _write_state(self) -> None:
        self.write(STATE, json.dumps(self._state, indent=1).encode())


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
