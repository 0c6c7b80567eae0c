"""A copy of the package, for tests that edit its code."""

from __future__ import annotations

import shutil
from pathlib import Path

ROOT = Path(__file__).parents[1]


def copied(folder: Path) -> Path:
    """The package copied into a folder, with links to what it looks for beside itself; returns the copy."""
    package = folder / "trainmj"
    shutil.copytree(ROOT / "trainmj", package, ignore=shutil.ignore_patterns("__pycache__"))
    for beside in ("mjcf", "scenarios", "docs"):
        (folder / beside).symlink_to(ROOT / beside)
    return package
