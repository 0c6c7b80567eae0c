"""README and docs as the tests read them: their code blocks, and a page as the script a reader would type."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = ["README.md", *(f"docs/{p.name}" for p in sorted((ROOT / "docs").glob("*.md")))]

_FENCE = re.compile(r"^```(?P<language>\S*)(?P<rest>[^\n]*)\n(?P<text>.*?)^```$", flags=re.DOTALL | re.MULTILINE)
_NOT_RUN = re.compile(r"^# not run by the tests: (.+)$", flags=re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A code block. One with a title is a file that the reader makes under this name."""

    page: str
    language: str
    title: str | None
    text: str

    @property
    def not_run(self) -> str | None:
        """Why the tests do not run it, as the block itself says."""
        match = _NOT_RUN.search(self.text)
        return match[1] if match else None

    @property
    def commands(self) -> list[list[str]]:
        """The words of each `trainmj` command in it."""
        lines = self.text.splitlines() if self.language == "sh" else []
        return [
            shlex.split(re.split(r" > | \|\| ", line)[0], comments=True)[1:]
            for line in lines
            if line.startswith("trainmj ")
        ]


def read(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def blocks(page: str) -> list[Block]:
    found = []
    for match in _FENCE.finditer(read(page)):
        title = re.search(r'title="([^"]+)"', match["rest"])
        found.append(Block(page, match["language"], title[1] if title else None, match["text"]))
    return found


def file_block(page: str, title: str) -> str:
    """The file of a title that a page shows."""
    (text,) = [block.text for block in blocks(page) if block.title == title]
    return text


def without_blocks(page: str) -> str:
    return _FENCE.sub("", read(page))


def script(page: str, part: slice = slice(None)) -> str:
    """A page, or some of its blocks, as one bash script: files are written, commands and Python are run, in order."""
    lines = []
    for block in blocks(page)[part]:
        if block.title is not None:
            lines.append(_here(f"cat > {shlex.quote(block.title)}", block.text))
        elif block.not_run is None and block.language == "sh":
            lines.append(block.text)
        elif block.not_run is None and block.language == "python":
            lines.append(_here("python -", block.text))
    return "\n".join(lines)


def _here(command: str, text: str) -> str:
    return f"{command} <<'END_OF_BLOCK'\n{text}END_OF_BLOCK"
