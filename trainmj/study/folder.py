"""The folder of a study: the tables and figures of each step, and a record of what they were made from.

A step is done if its inputs are those of last time and its files are as it left them. Files are replaced whole, so
whatever stops a study leaves either the old or the new one.
"""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Callable, Container, Mapping, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pydantic import TypeAdapter

from trainmj.cases.store import key_of
from trainmj.collision.identity import code_hash, identity
from trainmj.errors import InputError, OutputError
from trainmj.files.sealed import sealed, unsealed
from trainmj.files.tables import read_back
from trainmj.files.text import read_bytes
from trainmj.files.written import remove, write_bytes
from trainmj.output.page import REPORT
from trainmj.output.style import ENDINGS, Format, Width, encode, styled

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

V = TypeVar("V")
Tables = Mapping[str, "pd.DataFrame"]
"""Tables of a step by file name without ending."""

STATE = "steps.json"
ROBUST_FILES = "robust_"
"""Before the names of the files of the robust search."""

OF_STEPS = rf"({ROBUST_FILES})?\d\d_\w+\.(csv|{ENDINGS})"
"""The files of steps, as a pattern of their names."""

_MOST_BYTES = 100_000_000  # of a table or figure; of the record
_CHANGED = "is damaged, or was changed by hand: the same trainmj study command makes it again"


@dataclass(frozen=True)
class Output(Generic[V]):
    """What a step makes."""

    value: V  # what it hands on to later steps
    tables: Tables
    facts: Mapping[str, Any]  # for the summary, JSON only
    figures: Mapping[str, Callable[[], Figure]]  # by file name without ending; drawn when the tables are written


@dataclass(frozen=True)
class Step(Generic[V]):
    """A step that is done."""

    name: str
    tables: Tables  # as made or as read back, equal to the last digit
    facts: Mapping[str, Any]
    digest: str  # of the tables: what depends on the step depends on this
    seconds: float | None  # what it took now; None if it was there
    value: Callable[[], V]  # gives what it hands on to later steps, as made or as read back from its tables


@dataclass(frozen=True)
class _Record:
    """What the folder records of a step."""

    fingerprint: str  # of all that it depends on
    files: dict[str, str]  # digest of each, by name
    facts: dict[str, Any]
    figures: list[str]  # their width and formats


_RECORDS = TypeAdapter(dict[str, _Record])


class Folder:
    """The files of a study, with figures in the given formats and width.

    Attributes:
        steps: that are done, in their order.
    """

    def __init__(self, path: Path, figures: Sequence[Format], width: Width) -> None:
        """Read what it records."""
        self.path = path
        self._prefix = ""  # of the names of steps and files
        self._all: list[str] = []  # full names of the steps that are done
        self._figures, self._width = figures, width
        self._drawn: list[str] = [width, *figures] if figures else []
        self.steps: list[Step[Any]] = []
        self._state = self._read_state()

    def part(self, prefix: str) -> Folder:
        """The files of further steps, whose names begin with a prefix."""
        part = copy(self)
        part._prefix, part.steps = prefix, []
        return part

    def step(self, name: str, inputs: Any, make: Callable[[], Output[V]], read: Callable[[Tables], V]) -> Step[V]:
        """Take a step from the folder if it was made from these inputs there; make it otherwise.

        Args:
            name: of the step.
            inputs: all that it depends on, as JSON can hold it.
            make: does the work.
            read: gives the value that the work gave, from the tables that it left.
        """
        began = time.monotonic()
        fingerprint = key_of(name, identity(), _further(), inputs)
        full = f"{self._prefix}{name}"
        output = None if self._has(full, fingerprint) else make()
        if output:
            remove(self.path / REPORT)  # it would stand beside other numbers
            files = self._write(output)
            self._forget(full, kept=files)
            self._state[full] = _Record(fingerprint, files, dict(output.facts), self._drawn)
            self._write_state()
        record = self._state[full]
        digests = {file: digest for file, digest in record.files.items() if file.endswith(".csv")}
        tables = output.tables if output else {self._named(f): read_back(self.path / f) for f in digests}
        value = (lambda: output.value) if output else cache(partial(read, tables))
        seconds = time.monotonic() - began if output else None
        done = Step(name, tables, record.facts, key_of(*digests.values()), seconds, value)
        self.steps.append(done)
        self._all.append(full)
        return done

    def _named(self, file: str) -> str:
        """The name of a table without ending, as its step calls it."""
        return file.removesuffix(".csv").removeprefix(self._prefix)

    def start_over(self) -> None:
        """Remove the files of all steps, except those that somebody has changed."""
        for name in list(self._state):
            self._forget(name)

    def finish(self) -> None:
        """Put the record in order, and remove the files of steps that the study no longer has.

        Those that somebody has changed stay.
        """
        for name in self._state.keys() - set(self._all):
            self._forget(name)
        self._state = {name: self._state[name] for name in self._all}
        self._write_state()

    def tables(self) -> Tables:
        """The tables of all steps that the folder records, by their full names, read back.

        Raises:
            InputError: naming the first file that is not as it was written.
        """
        if not self._state:
            raise InputError(f"{self.path / STATE}: {_CHANGED}")
        found = {}
        for file, digest in (item for record in self._state.values() for item in record.files.items()):
            if file.endswith(".csv"):
                if self._digest_of(file) != digest:
                    raise InputError(f"{self.path / file}: {_CHANGED}")
                found[file.removesuffix(".csv")] = read_back(self.path / file)
        return found

    def write(self, name: str, content: bytes) -> str:
        """Replace a file as a whole and return the digest of its content.

        Raises:
            OutputError: if it cannot be written.
        """
        file = self.path / name
        try:
            write_bytes(file, content)
        except OutputError as error:
            raise OutputError(f"{error}; finished steps are kept") from None
        return _digest(content)

    def _has(self, name: str, fingerprint: str) -> bool:
        """Whether a step was made from the same inputs and all its files are as it left them."""
        record = self._state.get(name)
        if record is None or record.fingerprint != fingerprint or (self._figures and self._drawn != record.figures):
            return False
        return all(self._digest_of(file) == digest for file, digest in record.files.items())

    def _write(self, output: Output[V]) -> dict[str, str]:
        files = {
            (file := f"{self._prefix}{name}.csv"): self.write(file, table.to_csv(index=False).encode())
            for name, table in output.tables.items()
        }
        for name, draw in output.figures.items() if self._figures else ():
            with styled(self._width):
                picture = draw()
            for form in self._figures:
                file = f"{self._prefix}{name}.{form}"
                files[file] = self.write(file, encode(picture, form))
        return files

    def _forget(self, name: str, kept: Container[str] = ()) -> None:
        """Remove the files that a step left and no longer makes, except those that somebody has changed."""
        record = self._state.pop(name, None)
        for file, digest in record.files.items() if record else ():
            if file not in kept and self._digest_of(file) == digest:
                remove(self.path / file)

    def _digest_of(self, file: str) -> str:
        try:
            return _digest(read_bytes(self.path / file, _MOST_BYTES, follow=False))
        except InputError:
            return ""

    def _read_state(self) -> dict[str, _Record]:
        """The record of all steps; empty if there is none that trainmj wrote.

        Raises:
            InputError: if it names a file that is not one of a study.
        """
        try:
            state = _RECORDS.validate_python(unsealed(read_bytes(self.path / STATE, _MOST_BYTES, follow=False)))
        except ValueError:
            return {}
        for file in (file for record in state.values() for file in record.files):
            if not re.fullmatch(OF_STEPS, file):
                said = f"names the file {file[:100]!a}, which is not a plain name such as 01_design.csv"
                raise InputError(f"{self.path / STATE}: {said}: remove {STATE}")
        return state

    def _write_state(self) -> None:
        records = {name: vars(record) for name, record in self._state.items()}
        self.write(STATE, json.dumps(sealed(records), indent=1).encode())


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


@cache
def _further() -> list[str]:
    """What steps are computed with besides the collisions: the code of studies, and the packages that fit and draw."""
    found = [code_hash("study", "output")]
    for name in ("scipy", "scikit-learn", "matplotlib"):
        with suppress(PackageNotFoundError):  # scikit-learn is an extra
            found.append(f"{name} {version(name)}")
    return found
