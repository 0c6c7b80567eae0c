"""ISO-MME folders (ISO/TS 13499), in which crash laboratories pass on what a test recorded.

``NAME.mme`` says what was tested, ``Channel/NAME.chn`` lists the channels, and ``Channel/NAME.001`` and so on hold one
each: lines of a descriptor, a colon and its value, then a number a line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from trainmj.errors import InputError
from trainmj.files.text import printable, read_bytes

Array = npt.NDArray[np.float64]

MOST = 999
"""Channels of a folder: their number has three digits."""

CHANNELS = "Channel"
"""Its folder of channels."""

_EDITION = "1.6"
_MOST_BYTES = 50_000_000  # of a channel
_MOST_VALUES = 20_000_000  # of all channels
_NONE = "NOVALUE"
_LINE = re.compile(r"\s*([^:]*?)\s*:\s*(.*?)\s*")
_CODE = re.compile(r"[A-Za-z0-9?]{16}")
_WIDTH = 28  # of a descriptor


@dataclass(frozen=True)
class Channel:
    """A value over time.

    Attributes:
        code: of ISO/TS 13499, 16 characters.
        name: in words.
        unit: of the values: m/s, m/(s*s), N.
        time: (n,) [s]; written channels have evenly spaced ones.
        values: (n,); nan where there is none.
        own: the code that its laboratory has for it.
        more: further descriptors.
    """

    code: str
    name: str
    unit: str
    time: Array
    values: Array
    own: str = ""
    more: Mapping[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """The file of the channel."""
        first, last = int(np.argmax(self.values)), int(np.argmin(self.values))
        n = len(self.time)
        interval = (self.time[-1] - self.time[0]) / (n - 1)
        return _lines(
            {
                "Channel code": self.code,
                "Laboratory channel code": self.own,
                "Customer channel code": "",
                "Reference channel": "implicit",
                "Reference channel name": "",
                "Data source": "simulation",
                "Test object number": self.code[0],
                "Name of the channel": self.name,
                "Location": self.code,
                "Direction": self.code[14],
                "Dimension": self.code[12:14],
                **self.more,
                "Unit": self.unit,
                "Sampling interval": f"{interval:.12g}",
                "Time of first sample": f"{self.time[0]:.12g}",
                "Number of samples": str(n),
                "First global maximum value": _number(self.values[first]),
                "Time of maximum value": _number(self.time[first]),
                "First global minimum value": _number(self.values[last]),
                "Time of minimum value": _number(self.time[last]),
                "Data status": "ok",
            },
            map(_number, self.values.tolist()),
        )


def texts(name: str, about: Mapping[str, str], channels: Sequence[Channel]) -> dict[str, bytes]:
    """The files of a folder by their names, that of the test, ``NAME.mme``, last.

    Raises:
        InputError: if there are more channels than a folder can have.
    """
    if len(channels) > MOST:
        raise InputError(f"has {len(channels)} channels, more than the {MOST} of an ISO-MME folder: write xlsx or csv")
    listed = {f"Name of channel {n:03}": f"{c.code} / {c.name}" for n, c in enumerate(channels, start=1)}
    found = {f"{CHANNELS}/{name}.{n:03}": c.text() for n, c in enumerate(channels, start=1)}
    found[f"{CHANNELS}/{name}.chn"] = _lines({"Number of channels": str(len(channels)), **listed})
    found[f"{name}.mme"] = _lines({"Data format edition number": _EDITION, **about})
    return {file: text.encode("latin-1", "replace") for file, text in found.items()}


def _lines(descriptors: Mapping[str, str], values: Iterable[str] = ()) -> str:
    heads = [f"{key:<{_WIDTH}}:{' '.join(printable(text).split()) or _NONE}" for key, text in descriptors.items()]
    return "".join(f"{one}\r\n" for one in (*heads, *values))


def _number(value: float) -> str:
    return f"{value + 0.0:.9E}" if math.isfinite(value) else _NONE


def find(path: Path) -> Path | None:
    """The file of the test that a path leads to: itself, or the only one of its folder; None if it leads to none.

    Raises:
        InputError: if the folder has several.
    """
    if path.suffix.lower() == ".mme" and path.is_file():
        return path
    if not path.is_dir():
        return None
    there = sorted(file for file in path.iterdir() if file.suffix.lower() == ".mme")
    if len(there) > 1:
        raise InputError(f"{path}: has several tests: name one, as in {there[0]}")
    return there[0] if there else None


def read(file: Path) -> list[Channel]:
    """The channels of a test, by the file of it.

    Those that state neither a sampling interval nor a channel of times are left out, and so are channels of times.

    Raises:
        InputError: naming file, line and rule, if one cannot be read or there are none.
    """
    folder = next((f for f in file.parent.iterdir() if f.name.lower() == CHANNELS.lower() and f.is_dir()), None)
    pattern = re.compile(rf"{re.escape(file.stem)}\.\d{{3}}", re.IGNORECASE)
    files = sorted(f for f in folder.iterdir() if pattern.fullmatch(f.name)) if folder else []
    if not files:
        raise InputError(f"{file}: has no channels: {CHANNELS}/{file.stem}.001 and so on must be in a folder beside it")
    raw: list[tuple[Path, dict[str, str], Array]] = []
    for one in files:
        try:
            raw.append((one, *_parts(_text(one))))
        except InputError as error:
            raise InputError(f"{one}: {error}") from None
        if (total := sum(len(values) for _, _, values in raw)) > _MOST_VALUES:
            raise InputError(f"{file}: has more than {_MOST_VALUES} values ({total} up to {one.name})")
    clocks = {about.get("Channel code", ""): values for _, about, values in raw if about.get("Dimension") == "TI"}
    found = []
    for one, about, values in raw:
        try:
            time = _times(about, len(values), clocks)
        except InputError as error:
            raise InputError(f"{one}: {error}") from None
        code = about.get("Channel code", "")
        if not _CODE.fullmatch(code):
            raise InputError(f"{one}: Channel code = {code[:60]!a}: must have 16 letters and digits")
        if time is not None and code not in clocks:
            own = about.get("Laboratory channel code", "")
            name = about.get("Name of the channel", "")
            found.append(Channel(code, name, about.get("Unit", ""), time, values, own))
    if not found:
        raise InputError(f"{file}: has no channel with times")
    return found


def _text(file: Path) -> str:
    content = read_bytes(file, _MOST_BYTES)
    for coding in ("utf-8-sig", "cp1252"):
        try:
            return content.decode(coding)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")


def _parts(text: str) -> tuple[dict[str, str], Array]:
    """Descriptors and values of a channel."""
    about: dict[str, str] = {}
    values: list[float] = []
    for n, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        if not line.strip():
            continue
        try:
            values.append(math.nan if line.strip() == _NONE else float(line))
            continue
        except ValueError:
            match = _LINE.fullmatch(line)
        if match is None or values:
            raise InputError(f"line {n}: {line.strip()[:60]!a}: must be a number")
        about.setdefault(match[1], "" if match[2].upper() == _NONE else match[2])
    if any(math.isinf(value) for value in values):
        raise InputError("has an infinite value")
    stated = about.get("Number of samples", "")
    if stated.isdigit() and int(stated) != len(values):
        raise InputError(f"Number of samples = {stated}: it has {len(values)}")
    return about, np.array(values)


def _times(about: Mapping[str, str], n: int, clocks: Mapping[str, Array]) -> Array | None:
    """(n,) times [s]; None if there are none."""
    clock = about.get("Reference channel name", "")
    if about.get("Reference channel", "").lower() == "explicit" or (clock and not about.get("Sampling interval")):
        time = clocks.get(clock)
        if time is None or len(time) != n:
            raise InputError(f"Reference channel name = {clock[:60]!a}: must be a channel of {n} times of this test")
        return time
    if not about.get("Sampling interval"):
        return None
    first, interval = (_stated(about, key) for key in ("Time of first sample", "Sampling interval"))
    if not interval > 0.0:
        raise InputError(f"Sampling interval = {interval:g}: must be more than 0 s")
    return np.asarray(first + interval * np.arange(n))


def _stated(about: Mapping[str, str], key: str) -> float:
    text = about.get(key, "") or "0"
    try:
        value = float(text.removesuffix("s").strip())
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{key} = {text[:60]!a}: must be a number of seconds")
    return value
