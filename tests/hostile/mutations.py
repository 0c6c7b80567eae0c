"""How a good file goes wrong: in its values, in its text, as a file, and in the files it names."""
# ruff: noqa: E501

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from kinds import Kind

YAML_BOMB = "{a: &a [x,x,x,x,x,x,x,x,x], " + ", ".join(
    f"{new}: &{new} [{','.join([f'*{old}'] * 9)}]" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
) + "}"  # fmt: skip


@dataclass(frozen=True)
class Raw:
    """YAML text as it stands."""

    text: str


@dataclass(frozen=True)
class Pairs:
    """A group that may have a key twice."""

    items: tuple[tuple[Any, Any], ...]


Special = Callable[[Path], None]
"""Makes something at a path that is no plain file."""


def emit(value: Any) -> str:
    """A value as YAML, whatever it is."""
    if isinstance(value, Raw):
        return value.text
    if isinstance(value, Pairs | dict):
        items = value.items if isinstance(value, Pairs) else value.items()
        return "{" + ", ".join(f"{emit(k)}: {emit(v)}" for k, v in items) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(emit, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, str):
        return json.dumps(value)
    if value is None or isinstance(value, bool):
        return "null" if value is None else str(value).lower()
    return "9" * 401 if isinstance(value, int) and value >= 10**400 else repr(value)


def document(values: Any) -> str:
    """A whole file, a line for each key."""
    if not isinstance(values, dict):
        return emit(values)
    return "".join(f"{emit(key)}: {emit(value)}\n" for key, value in values.items())


def written(name: str, values: Any) -> str:
    """The text of a file of values."""
    return emit(values) if name.endswith(".json") else document(values)


def nested(depth: int) -> Raw:
    return Raw("[" * depth + "]" * depth)


TEXTS = [
    "", " ", "x", "a" * 5000, "=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "[red]x[/red]", "[/nope]", "[link=x]",
    "<script>alert(1)</script>", "-->", "--", "]]>", "&lt;", "'; DROP TABLE results; --", '"', "`id`", "$(id)",
    "$\\frac{$", "$5 and $6", "%s%n", "{0}{x}", "\x1b[2J\x1b]0;owned\x07", "\r", "a\rb", "\0", "\ud800", "\u202e",
    "\x7f", "\x9b31m", "\ufffe", "a\nb", "a\tb", "été", "列車", "🚆", "é" * 41, "rigid_wall", "b_type", "head", "link",
    "wagons", "tube", "file", "simulation", "collision.gap_mm", "devices", "trains.wagons.vehicles.0.name", ".", "..",
    "../base.yaml", "/etc/passwd", "/dev/zero", "/dev/stdin", "/proc/self/environ", "a/b/c", "~root", "CON", "my.yaml",
    "base.yaml", "x" * 300 + ".yaml", "20:50:9", "1:2:1000000000000", "1:2:3:4", "::", ",", "1,,2", "*", "[!", "**/*",
    "1", "1.0", "nan", "D", "TS", "D*M", "D^99999999", "D^0", "D*", "^", "minimise", "status", "case", "TS_mm",
    "reason", "mass_t", "\\", "c:\\x", "a\u2028b", "0x", "1e999", "title", "notes",
]  # fmt: skip
NUMBERS = [
    0, -0.0, -1, 1, 2, 3, 7, 0.5, 1e-9, 5e-324, 1e-300, 1e12, 1e300, 1.7e308, -1.7e308, math.nan, math.inf, -math.inf,
    10**6, 10**9, 10**12, 10**30, 10**400, 2**31, 2**63, -(2**63) - 1, 2**64, 100, 400, 401, 5000,
]  # fmt: skip
RAWS = [
    Raw("!!python/object/apply:os.system ['touch owned']"), Raw("!!python/name:os.system"), Raw("!x y"), Raw("!!set {a}"),
    Raw("!!binary aGk="), Raw("2026-11-22"), Raw("2026-11-22T10:00:00Z"), Raw("&a [*a]"), Raw("&b {b: *b}"),
    Raw("*undefined"), Raw(YAML_BOMB), Raw("{<<: {mass_t: 1}}"), Raw("0b11"), Raw("0x1F"), Raw("0o17"), Raw("1_000"),
    Raw("9" * 5000), Raw("-"), Raw("?"), Raw("|"), Raw("yes"), Raw("12:30:45"), Raw("!!float 'x'"), Raw("!!int 1.5"),
    Raw("{1: 2}"), Raw("{[a]: 1}"), Raw("{? {a: 1}: 2}"), Raw("!!omap [a: 1]"), Raw("!!str 5"), nested(20), nested(29),
    nested(40), nested(2000), Raw("{a: " * 25 + "1" + "}" * 25), Raw("{{}}"), Raw("%"), Raw("'"), Raw('"\\x"'),
    Raw("=") , Raw("~"), Raw("!!timestamp 5"), Raw("!!null x"), Raw("!!bool maybe"),
]  # fmt: skip
OTHERS = [
    None, True, False, [], {}, [[]], [None], [1], [0, 1], [1, 0], [0.0, 0.0], [1, 2, 3], ["a", "a"], ["a"], {"file": "tube.csv"},
    {"file": "none.csv"}, {"file": "../tube.csv"}, {"file": "/dev/zero"}, {"file": "x" * 300}, {"file": "a\0b"},
    {"file": "base.yaml"}, {"file": 3}, {"stroke_mm": [0, 1], "force_kN": [0, 1]}, {"stroke_mm": [0], "force_kN": []},
    {"stroke_mm": [0, 1e-300], "force_kN": [0, 1e6]}, {"stroke_mm": [0, 1e6], "force_kN": [0, 1e-300]},
    {"": 1}, {"a b": 1}, {"=x": 1}, {"name": "A"}, {"from": 1, "to": 2, "count": 10**12}, {"from": 1, "to": 2, "count": 3},
    {"from": 2, "to": 1, "count": 2}, {"uniform": [1, 2]}, {"choice": [None, [], {}]}, {"choice": []}, list(range(3000)),
    {f"k{i}": 1 for i in range(1500)}, [{"name": f"V{i}"} for i in range(410)], [{"name": f"V{i}"} for i in range(30)],
    {f"c{i}": {"stroke_mm": [0, 1], "force_kN": [0, 1]} for i in range(300)}, ["link"] * 120, [math.nan, 1], [[1, 2], 3],
    {"at_most": 1, "at_least": 2}, {"at_least": -1e300}, {"kind": "kriging"}, {"order": 6}, {"kind": "sobol", "n": 5000},
]  # fmt: skip
STRANGE: list[Any] = [*TEXTS, *NUMBERS, *RAWS, *OTHERS]

strange = (
    st.sampled_from(STRANGE)
    | st.sampled_from(STRANGE)
    | st.text(max_size=8)
    | st.floats()
    | st.integers(-(10**20), 10**20)
)


def places(values: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of everything in nested values, the whole first."""
    found = [path]
    if isinstance(values, dict):
        for key, value in values.items():
            found += places(value, (*path, key))
    elif isinstance(values, list):
        for i, value in enumerate(values):
            found += places(value, (*path, i))
    return found


def replaced(values: Any, path: tuple[Any, ...], change: Callable[[Any], Any]) -> Any:
    """A copy with the value at a path put through a change."""
    if not path:
        return change(values)
    if isinstance(values, dict):
        return {k: replaced(v, path[1:], change) if k == path[0] else v for k, v in values.items()}
    return [replaced(v, path[1:], change) if i == path[0] else v for i, v in enumerate(values)]


@st.composite
def wrong_values(draw: st.DrawFn, values: Any) -> tuple[Any, str]:
    """Values of a file, one to three of them wrong, and what was done."""
    said = []
    for _ in range(draw(st.sampled_from([1, 1, 1, 2, 3]))):
        where = draw(st.sampled_from([p for p in places(values) if p] or [()]))
        parent, key = where[:-1], (where or ("",))[-1]
        what = draw(
            st.sampled_from(["value", "value", "value", "value", "scale", "drop", "rename", "add", "twice", "move"])
        )
        if what == "value" or not where:
            new = draw(strange)
            values = replaced(values, where, lambda _, new=new: new)
        elif what == "scale":
            factor = draw(st.sampled_from([-1, 0, 1e-3, 1e3, 1e-6, 1e6, 1e9, 1e-12, 1e200]))
            values = replaced(
                values,
                where,
                lambda v, f=factor: v * f if isinstance(v, int | float) and not isinstance(v, bool) else [v],
            )
        elif what == "drop":
            values = replaced(values, parent, lambda v, key=key: _without(v, key))
        elif what == "rename":
            name = draw(st.sampled_from(TEXTS) | st.text(max_size=5))
            values = replaced(values, parent, lambda v, key=key, name=name: _renamed(v, key, name))
        elif what == "add":
            name, new = draw(st.sampled_from(TEXTS)), draw(strange)
            values = replaced(values, where, lambda v, name=name, new=new: _added(v, name, new))
        elif what == "twice":
            values = replaced(values, parent, lambda v, key=key: _doubled(v, key))
        else:
            other = draw(st.sampled_from(places(values)))
            part = _at(values, other)
            values = replaced(values, where, lambda _, part=part: part)
        said.append(f"{what} {'.'.join(map(str, where))}")
        if not isinstance(values, dict | list):
            break
    return values, "; ".join(said)


def _at(values: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        values = values[key]
    return values


def _without(values: Any, key: Any) -> Any:
    if isinstance(values, dict):
        return {k: v for k, v in values.items() if k != key}
    return [v for i, v in enumerate(values) if i != key]


def _renamed(values: Any, key: Any, name: str) -> Any:
    return {name if k == key else k: v for k, v in values.items()} if isinstance(values, dict) else values


def _added(values: Any, name: str, new: Any) -> Any:
    if isinstance(values, dict):
        return values | {name: new}
    return [*values, new] if isinstance(values, list) else [values, new]


def _doubled(values: Any, key: Any) -> Any:
    if isinstance(values, list):
        return [*values, values[key]]
    return Pairs((*values.items(), (key, values[key])))


BYTES = [
    b"\0", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", b"\x1b[2J", b"\t", b"\r", b"{", b"}", b"[", b"]", b":", b": ", b"- ",
    b"'", b'"', b"&a ", b"*a", b"!!python/object:x ", b"#", b"|\n", b">\n", b"---\n", b"...\n", b"%YAML 1.1\n", b"? ",
    b"\n", b"\n\n   ", b",", b"\xc3", b"\xe2\x80\xae", b"=", b"1e999", b"\x85", b"\x0b", b"<<: *a\n", b"@", b"`", b";",
]  # fmt: skip


@st.composite
def wrong_bytes(draw: st.DrawFn, content: bytes) -> tuple[bytes, str]:
    """A file whose bytes were changed without regard to what they mean, and how."""
    what = draw(st.sampled_from(["cut", "put", "put", "lose", "again", "flip", "encode"]))
    a = draw(st.integers(0, len(content)))
    b = min(len(content), a + draw(st.integers(0, 40)))
    if what == "cut":
        content = content[:a]
    elif what == "put":
        content = content[:a] + draw(st.sampled_from(BYTES)) * draw(st.sampled_from([1, 1, 3, 500])) + content[a:]
    elif what == "lose":
        content = content[:a] + content[b:]
    elif what == "again":
        content = content[:b] + content[a:b] * draw(st.sampled_from([1, 2, 100])) + content[b:]
    elif what == "flip" and a < len(content):
        content = content[:a] + bytes([content[a] ^ draw(st.integers(1, 255))]) + content[a + 1 :]
    elif what == "encode":
        code = draw(st.sampled_from(["utf-16", "utf-16-le", "utf-32", "utf-8-sig", "cp037", "utf-7"]))
        content = content.decode(errors="replace").encode(code, "replace")
    return content, f"{what} at {a}"


CELLS = [
    "", " ", "9" * 400, "-" + "9" * 99, "0" * 400, "1e400", "1e99", "1e-400", "nan", "inf", "-inf", "1_000", "٣", "0x1F", "1d5",
    "1,5", "1.5", "1.200", "1,200", "1.234,5", "1 200", "1'200", "1\u202f200", '"1,200"', '"1,5"', '"a, b"', '"a\nb"', '"', '""',
    "1,2", "1;2", "1\t2", "#", "=1+1", "@x", "x" * 5000, "800000", "0.001", "link", "head", "M", "a,b,,,", ",", ";;;", "2\n\n#3",
]  # fmt: skip


@st.composite
def wrong_cells(draw: st.DrawFn, content: bytes) -> tuple[bytes, str]:
    """A table some of whose cells, rows or columns are wrong, and what was done."""
    rows = [line.split(",") for line in content.decode().splitlines()]
    row = draw(st.integers(0, len(rows) - 1))
    column = draw(st.integers(0, len(rows[row]) - 1))
    what = draw(st.sampled_from(["cell", "cell", "cell", "cell", "row", "columns", "many heads", "marks", "sep"]))
    cell = draw(st.sampled_from(CELLS))
    if what == "cell":
        rows[row][column] = cell
    elif what == "row":
        rows[row] = draw(st.sampled_from([rows[row][:-1], [*rows[row], cell], rows[row] * 3000, [cell], []]))
    elif what == "columns":
        rows = [[*cells, cells[column % len(cells)]] for cells in rows]
    elif what == "many heads":
        rows = [[f"{cells[0]}{n}" for n in range(50_000)] for cells in rows[:2]]
    text = "\n".join(",".join(cells) for cells in rows) + "\n"
    if what == "marks":
        text = text.replace(",", draw(st.sampled_from([";", "\t"]))).replace(".", ",")
    elif what == "sep":
        text = f"sep={draw(st.sampled_from(',;|'))}\n{text}"
    return text.encode(), f"{what} at {row}, {column}"


def _folder(path: Path) -> None:
    path.mkdir()


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _link(target: str) -> Special:
    def make(path: Path) -> None:
        path.symlink_to(target)

    make.__name__ = f"link to {target}"
    return make


def _nothing(path: Path) -> None:
    """The file is missing."""


SPECIALS: list[bytes | Special] = [
    _folder, _pipe, _nothing, _link("/dev/zero"), _link("/dev/random"), _link("/etc/passwd"), _link("/nowhere"),
    _link("../outside.yaml"), b"", b"\n", b" \n\n#\n", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(range(256)) * 4,
    b"PK\x03\x04" + b"\0" * 100, b"\x80\x04\x95\x0b\0\0\0\0\0\0\0\x8c\x02os\x8c\x06system\x93.", b" " * 6_000_000,
    b"a: [" + b"?," * 60_000, b"- " * 50_000, b"stroke_mm,force_kN\n" + b"1,1\n" * 5000, b"a\n" * 1_200_000,
    b'stroke_mm,force_kN\n0,"0\n1,1\n', b"stroke_mm,force_kN\n0," + b"9" * 200_000 + b"\n", b"x,x\n1,2\n", b"1,2\n3,4\n",
    b"stroke_mm,force_kN\n0,0\n1,nan\n", b"stroke_mm,force_kN\n0,0\n1e400,1\n", b"stroke_mm,force_kN\n0,=1+1\n2,3\n",
    b"=cmd()\n1\n", b"mass_t\n=1+1\n", b"D,M,device\n20,30,link\n20,30,link\n", b"D,M,device\n1e9,nan,\n1,2,3\n",
    b"builds_on: my.yaml\n", b"builds_on: base.yaml\n", b"&a !!map {a: *a}\n", b"%TAG ! tag:x,2000:\n--- !y\na: 1\n",
    ("a: 'é'\n").encode("latin-1"), b"a: 1\n" * 2, b"\xef\xbb\xbf\xef\xbb\xbftitle: x\n",
]  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """The files of a kind, one of them wrong.

    Attributes:
        files: content, or what makes it, by name.
        said: what was done.
    """

    files: dict[str, bytes | Special]
    said: str

    def write(self, folder: Path) -> None:
        for name, content in self.files.items():
            if isinstance(content, bytes):
                (folder / name).write_bytes(content)
            else:
                content(folder / name)


def good(kind: Kind) -> dict[str, bytes]:
    """The files of a kind as they should be."""
    return {n: v if isinstance(v, bytes) else written(n, v).encode() for n, v in kind.files().items()}


@st.composite
def mutants(draw: st.DrawFn, kind: Kind) -> Mutant:
    """The files of a kind with one of them wrong."""
    files: dict[str, Any] = dict(good(kind))
    name = draw(st.sampled_from([kind.main] * 6 + list(files)))
    way = draw(st.sampled_from(["values"] * 6 + ["bytes"] * 3 + ["special"]))
    values = kind.files()[name]
    if way == "values" and not isinstance(values, bytes):
        wrong, said = draw(wrong_values(values))
        files[name] = written(name, wrong).encode("utf-8", "surrogatepass")
    elif way == "values" and name.endswith(".csv") and kind.main.endswith(".yaml"):
        files[name], said = draw(wrong_cells(files[name]))
    elif way == "special":
        files[name] = draw(st.sampled_from(SPECIALS))
        said = "special"
    else:
        files[name], said = draw(wrong_bytes(files[name]))
    return Mutant(files, f"{name}: {said}")
