"""Files that ship with trainmj, and the search for a file by its path or as a shipped one by its name."""

from __future__ import annotations

from pathlib import Path

from trainmj.errors import EngineError, InputError, close_match
from trainmj.files.arguments import file_given
from trainmj.files.kinds import KINDS, SCENARIO, Kind, kind_of

_PACKAGE = Path(__file__).resolve().parents[1]


def shipped_folder(name: str) -> Path:
    """The folder of a name: inside an installed package, or at the top of a checkout.

    Raises:
        EngineError: if it is in neither place, as in a damaged installation.
    """
    for folder in (_PACKAGE / name, _PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise EngineError(f"the folder {name}/ is missing from this installation of trainmj: reinstall it")


def shipped_files(ending: str) -> dict[str, Path]:
    """Names and paths of the files in scenarios/ and below with an ending, such as ``.yaml`` or ``.study.yaml``."""
    files = sorted(shipped_folder("scenarios").rglob(f"*{ending}"))
    names = {path.name.removesuffix(ending): path for path in files}
    return {name: path for name, path in names.items() if "." not in name}  # another ending begins with one


def find_file(file: str | Path, ending: str, what: str) -> Path:
    """The file of a path, or the shipped one of a name; what it is, such as a scenario, is for messages.

    Raises:
        InputError: if there is neither.
    """
    path, known = file_given(file), shipped_files(ending)
    try:
        there, folder = path.is_file(), path.is_dir()
        hides = there and str(file) in known and path.resolve() != known[str(file)].resolve()
    except (OSError, ValueError):
        raise InputError(f"{ascii(str(file))[:200]}: is not a usable file name") from None
    if hides:
        raise InputError(f"{file}: is a file here, and the name of a shipped {what}: write ./{file} or {file}{ending}")
    if there:
        return path
    name = str(file).removesuffix(ending)
    if name in known:
        return known[name]
    missing = f"is a folder, not a {what} file" if folder else f"there is no such file or shipped {what}"
    raise InputError(f"{file}: {missing}{close_match(path.name.removesuffix(ending), known)}")


def kind_at(file: str) -> Kind:
    """The kind of the input file at a path, or of the shipped one of a name: a scenario file where nothing tells.

    Raises:
        InputError: if there is a file that cannot be read as YAML.
    """
    from trainmj.files.yaml import read_yaml  # late: names alone are found without it

    try:
        there = Path(file).is_file()
    except (OSError, ValueError):
        return SCENARIO  # the search for a scenario of this name reports it
    if there:
        others = (k for k in KINDS if k is not SCENARIO and file.endswith(k.ending))
        return kind_of(read_yaml(Path(file)).values) or next(others, SCENARIO)
    return next((k for k in KINDS if file.removesuffix(k.ending) in shipped_files(k.ending)), SCENARIO)
