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


_COMPUTING = ("units.py", "symbol.py", "scenario", "doe", "collision")
"""What numbers come from, beside the packages: files and folders of trainmj."""


def code_hash(*parts: str) -> str:
    """Hash of the code of some files and folders of trainmj: changes with any edit, whatever the version says."""
    return hashlib.sha256(b"".join(map(_digest, parts))).hexdigest()[:16]


@cache
def _digest(part: str) -> bytes:
    """Digest of a file or folder, which a process reads once."""
    package = Path(__file__).parents[1]
    content = hashlib.sha256()
    for file in [package / part] if part.endswith(".py") else sorted((package / part).rglob("*.py")):
        content.update(f"{file.relative_to(package).as_posix()}\0".encode() + file.read_bytes())
    return content.digest()


IMPORTED = {name: version(name) for name in _PACKAGES} | {"law": code_hash(*_COMPUTING)}
"""What this process has imported, and computes with for as long as it lives, whatever is installed meanwhile."""


@cache
def _identity() -> tuple[tuple[str, str], ...]:
    from llvmlite.binding import get_host_cpu_name

    where = f"{platform.system()} {platform.machine()} {get_host_cpu_name()}"
    return tuple((IMPORTED | {"python": platform.python_version(), "platform": where}).items())


def identity() -> dict[str, str]:
    """Versions of what computes a collision, the platform with its processor, and a hash of the device law and all
    other code that numbers come from.
    """
    return dict(_identity())


def changes(then: Mapping[str, str], now: Mapping[str, str], words: tuple[str, str] = ("then", "now")) -> list[str]:
    """What differs between two identities, in words: ``numba 0.60.0 then, 0.61.2 now``."""
    return [
        f"{name} {then.get(name, 'unknown')} {words[0]}, {value} {words[1]}"
        for name, value in now.items()
        if then.get(name, "unknown") != value
    ]
