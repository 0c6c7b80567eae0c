"""Compiled functions, kept on disk as machine code.

A file begins with a digest of all that its code depends on: the law, what compiled it, the processor, and the places of
MuJoCo's fields. It ends with a digest of what is before that. What is damaged, what another user may have written, and
what a process with another law has, is compiled afresh and replaced; what cannot be written stays in this process. LLVM
alone loads the code. numba, whose import takes as long as many collisions, is asked only for what is not there.
"""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple, cast

import llvmlite
from llvmlite import binding as llvm

from trainmj.collision.block import MAGIC
from trainmj.collision.identity import IMPORTED
from trainmj.collision.offsets import Offsets
from trainmj.errors import OutputError
from trainmj.files.written import remove, write_bytes

_DIGEST = 32
_MOST_BYTES = 10_000_000  # of a file; they have some 70 kB
_NOT_KEPT = "the compiled law is not kept between processes"
_kept: dict[int, Any] = {}  # what is at an address lives as long as the process: MuJoCo holds bare pointers
_number = count()  # no two libraries in a process may have one name


def address_of(factory: Callable[[Offsets], Callable[..., Any]], signature: str, offsets: Offsets) -> tuple[int, str]:
    """Load a C function from disk, or compile it.

    Args:
        factory: makes what numba can compile from the places of MuJoCo's fields.
        signature: its types, in the words of numba.
        offsets: these places.

    Returns:
        Its address, good as long as this process; and what was wrong with the copy on disk, if anything.
    """
    name = factory.__name__.strip("_")
    versions = IMPORTED["numba"], llvmlite.__version__, IMPORTED["mujoco"], sys.version
    wanted = sha256(repr((name, signature, *offsets, MAGIC, *versions, *_machine())).encode()).digest()
    file = _folder() / f"law.{name}.{sys.implementation.cache_tag}.{_machine().mark}"
    found, trouble = _read(file)
    if found[:_DIGEST] == wanted and (address := _linked(name, found[_DIGEST:])):
        return address, ""
    address, code = _compiled(factory(offsets), signature, name)
    if not code:
        return address, f"{_NOT_KEPT} (LLVM alone cannot load it on this system)"
    try:
        if trouble:
            remove(file)
        content = wanted + code
        write_bytes(file, content + sha256(content).digest(), 0o644)
    except OutputError as error:
        trouble = f"{_NOT_KEPT} ({error}); set NUMBA_CACHE_DIR to a writable folder"
    return address, trouble


def _compiled(function: Callable[..., Any], signature: str, name: str) -> tuple[int, bytes]:
    """Address of a function that numba compiles, and its machine code if it works in other processes, too."""
    from trainmj.collision.compiler import compiled, machine_code

    found = compiled(function, signature)
    with suppress(AttributeError, RuntimeError):  # an older LLVM, or one that cannot make what it could load
        code = machine_code(found, name, _machine().target())
        if address := _linked(name, code):
            return address, code
    _kept[found.address] = found
    return cast(int, found.address), b""


def _linked(name: str, code: bytes) -> int:
    """Make machine code ready to run: address of its function, or 0 if it needs what this process does not have."""
    library = llvm.JITLibraryBuilder().add_object_img(code).add_current_process().export_symbol(name)
    try:
        linked = library.link(_jit(), f"{name} {next(_number)}")
    except RuntimeError:
        return 0
    _kept[linked[name]] = linked
    return cast(int, linked[name])


@cache
def _jit() -> Any:
    return llvm.create_lljit_compiler(_machine().target(), use_jit_link=True, suppress_errors=True)


class _Machine(NamedTuple):
    """What code is made for; numba's settings are obeyed."""

    triple: str
    cpu: str
    features: str

    @property
    def mark(self) -> str:
        """What distinguishes its files from those of other machines that share the folder."""
        return sha256(repr(tuple(self)).encode()).hexdigest()[:8]

    def target(self) -> Any:
        """What LLVM makes code with."""
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        target = llvm.Target.from_triple(self.triple)
        return target.create_target_machine(
            cpu=self.cpu,
            features=self.features,
            opt=3,
            reloc="static" if target.name.startswith("x86") else "default",  # as numba has it
            codemodel="jitdefault",
            jit=True,
        )


@cache
def _machine() -> _Machine:
    features = ""
    with suppress(RuntimeError):  # not known of every processor
        known = llvm.get_host_cpu_features()
        if os.environ.get("NUMBA_ENABLE_AVX") == "0":
            known.update({name: False for name in known if name.startswith("avx")})
        features = known.flatten()
    return _Machine(
        llvm.get_process_triple(),
        os.environ.get("NUMBA_CPU_NAME") or llvm.get_host_cpu_name(),
        os.environ.get("NUMBA_CPU_FEATURES") or features,
    )


def _folder() -> Path:
    """Where compiled functions are kept, as numba keeps its own: the first of these folders that can be written to."""
    here = Path(__file__).parent
    own = f"trainmj_{sha256(str(here).encode()).hexdigest()[:16]}"
    named = os.environ.get("NUMBA_CACHE_DIR")
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser(_HOMES.get(sys.platform, "~/.cache"))
    folders = [*([Path(named, own).absolute()] if named else []), here / "__pycache__", Path(home, own)]
    for folder in folders:
        if folder.is_absolute():  # else there is no home
            with suppress(OSError):
                folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK | os.X_OK):
                return folder
    return folders[0]


_HOMES = {"darwin": "~/Library/Caches", "win32": "~/AppData/Local"}
"""Where users of some systems have caches."""


def _read(file: Path) -> tuple[bytes, str]:
    """What a file holds, without the digest at its end, and what is wrong with it; nothing is run that is damaged."""
    if not os.path.lexists(file):
        return b"", ""
    content = b""
    with suppress(OSError):
        if file.is_file():
            with file.open("rb") as opened:
                there = os.fstat(opened.fileno())
                content = opened.read(_MOST_BYTES)
    if sha256(content[:-_DIGEST]).digest() != content[-_DIGEST:]:
        return b"", f"the compiled law on disk was damaged ({file}): {_AFRESH}"
    if os.name == "posix" and (there.st_uid not in _trusted() or there.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        return b"", f"the compiled law on disk is open to other users ({file}): {_AFRESH}"
    return content[:-_DIGEST], ""


def _trusted() -> set[int]:
    """Users whose code runs here in any case: this one, root, and the owner of this very file."""
    return {os.geteuid(), 0, os.stat(__file__).st_uid}


_AFRESH = "it is compiled afresh"
