"""What computed a number: where all of it is the same, so is every bit.

An old number is used again only where its identity is that of today.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path

_PACKAGES = ("trainmj", "mujoco", "numba", "numpy")


@cache
def law_hash() -> str:
    """Hash of the code that computes a collision: changes with any edit of this package, whatever its version says."""
    folder = Path(__file__).parent
    content = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        content.update(f"{file.relative_to(folder).as_posix()}\0".encode() + file.read_bytes())
    return content.hexdigest()[:16]


@cache
def _identity() -> tuple[tuple[str, str], ...]:
    from llvmlite.binding import get_host_cpu_name

    parts = {name: version(name) for name in _PACKAGES}
    parts["python"] = platform.python_version()
    parts["platform"] = f"{platform.system()} {platform.machine()} {get_host_cpu_name()}"
    parts["law"] = law_hash()
    return tuple(parts.items())


def identity() -> dict[str, str]:
    """Versions of what computes a collision, the platform with its processor, and the hash of the law."""
    return dict(_identity())


def changes(then: Mapping[str, str], now: Mapping[str, str], words: tuple[str, str] = ("then", "now")) -> list[str]:
    """What differs between two identities, in words: ``numba 0.60.0 then, 0.61.2 now``."""
    return [
        f"{name} {then.get(name, 'unknown')} {words[0]}, {value} {words[1]}"
        for name, value in now.items()
        if then.get(name, "unknown") != value
    ]
