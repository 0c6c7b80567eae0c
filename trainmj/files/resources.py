"""Files that ship with trainmj: scenarios/ and mjcf/."""

from __future__ import annotations

from pathlib import Path

from trainmj.errors import EngineError

_PACKAGE = Path(__file__).resolve().parents[1]


def shipped_folder(name: str) -> Path:
    """The folder of that name: inside an installed package, or at the top of a checkout.

    Raises:
        EngineError: if it is in neither place, as in a damaged installation.
    """
    for folder in (_PACKAGE / name, _PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise EngineError(f"the folder {name}/ is missing from this installation of trainmj: install it again")


def shipped_files(ending: str) -> dict[str, Path]:
    """Names and paths of the files with an ending in scenarios/ and its folders.

    Args:
        ending: ``.yaml``, ``.study.yaml`` or ``.targets.yaml``; the rest of a file's name is its own and has no dot.
    """
    files = sorted(shipped_folder("scenarios").rglob(f"*{ending}"))
    names = {path.name.removesuffix(ending): path for path in files}
    return {name: path for name, path in names.items() if "." not in name}
