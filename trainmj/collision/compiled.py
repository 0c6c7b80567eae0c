"""Compiled functions, from numba's cache on disk where it holds them whole.

numba itself ends in a traceback where a file of its cache is torn, and on a full disk. Here each file ends with a
digest of what is before it, and compiled code names what it was compiled from. What is damaged, or was written at the
same time by a process with another law, is compiled afresh and replaced; what cannot be written stays in this process.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any, cast

from llvmlite import ir
from numba.core import sigutils
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.ccallback import CFunc
from numba.core.targetconfig import ConfigStack

_DIGEST = 32
_kept: list[Any] = []  # compiled functions live as long as the process: MuJoCo holds bare pointers


def address_of(function: Callable[..., Any], signature: str) -> tuple[int, str]:
    """Compile a C function, or take it from disk. A division by zero in it is no exception: nobody would see one.

    Args:
        function: what numba can compile.
        signature: its types, in the words of numba.

    Returns:
        Its address, good as long as this process; and what was wrong with the cache, if anything.
    """
    compiled: Any = CFunc(function, sigutils.normalize_signature(signature), {}, {"error_model": "numpy"})
    trouble = ""
    try:
        compiled._cache = cache = _Cache(function)
    except RuntimeError as error:  # numba found no folder that it can write to
        trouble = _not_kept(str(error))
    compiled.compile()
    if not trouble:
        trouble = cache.trouble
    _kept.append(compiled)
    return cast(int, compiled.address), trouble


def noinline(context: Any, builder: Any, function: Callable[..., Any], signature: Any, args: Any) -> Any:
    """Within an intrinsic of numba: call a function that LLVM must not make a part of its caller.

    It is compiled like its caller, which numba does not do by itself: a division by zero is no exception there either.
    """
    flags = ConfigStack.top_or_none().copy()
    flags.forceinline = False
    compiled = context.compile_subroutine(builder, function, signature, flags=flags)
    found = context.call_internal(builder, compiled.fndesc, signature, args)
    for block in builder.function.blocks:
        for made in block.instructions:
            if isinstance(made, ir.CallInstr) and made.callee.name == compiled.fndesc.llvm_func_name:
                made.attributes.add("noinline")
    return found


def _not_kept(why: str) -> str:
    return f"the compiled law is not kept between processes ({why}); set NUMBA_CACHE_DIR to a writable folder"


class _Cache(FunctionCache):
    """The cache of one function; it always gives way to the compiler."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self.trouble = ""
        self._cache_file = self._files = _Files(
            self._cache_path, self._impl.filename_base, self._impl.locator.get_source_stamp()
        )

    def load_overload(self, signature: Any, target: Any) -> Any:
        found = super().load_overload(signature, target)
        if self._files.damaged:
            self.trouble = f"the compiled law on disk was damaged ({self._files.damaged}): it is compiled afresh"
        return found

    def save_overload(self, signature: Any, compiled: Any) -> None:
        try:
            super().save_overload(signature, compiled)
        except OSError as error:
            self.trouble = _not_kept(f"{error.filename2 or self._cache_path}: {error.strerror or error}")


class _Files(IndexDataCacheFile):
    """Its files: an index, and the code of each signature."""

    damaged = ""  # the file that was

    def save(self, key: Any, code: Any) -> None:
        super().save(key, (self._origin(key), code))

    def load(self, key: Any) -> Any:
        origin, code = super().load(key) or (None, None)
        return code if origin == self._origin(key) else None  # two processes number their files alike

    def _origin(self, key: Any) -> tuple[Any, ...]:
        return self._version, self._source_stamp, key

    def _load_index(self) -> Any:
        return super()._load_index() if self._whole(self._index_path) else {}

    def _load_data(self, name: str) -> Any:
        return super()._load_data(name) if self._whole(self._data_path(name)) else None

    @contextmanager
    def _open_for_write(self, path: str) -> Iterator[BytesIO]:
        content = BytesIO()
        yield content
        with super()._open_for_write(path) as file:
            file.write(content.getvalue() + sha256(content.getvalue()).digest())

    def _whole(self, path: str) -> bool:
        """Whether a file is as it was written; only then is it unpickled, which may run any code."""
        if not os.path.lexists(path):
            return False
        try:
            content = Path(path).read_bytes() if Path(path).is_file() else b""
        except OSError:
            content = b""
        whole = sha256(content[:-_DIGEST]).digest() == content[-_DIGEST:]
        if not whole:
            self.damaged = path
        return whole
