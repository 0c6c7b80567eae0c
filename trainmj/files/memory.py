"""Memory that may be limited, as by ``ulimit -v`` or a batch system: looked for before a library meets the limit.

Not all of them bear it: OpenBLAS asks for memory for ever when it is loaded and there is none, or ends the process, and
so does MuJoCo when it reads a model.
"""

from __future__ import annotations

import mmap
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from typing import Any

from trainmj.errors import EngineError

NEEDED = 1000
"""What a command that computes finds at least when it begins [MB of address space]: libraries, and room to work."""

_M_ARENA_MAX = -8


def room(megabytes: int) -> None:
    """See that a process may take so much more memory; nothing is taken.

    Raises:
        MemoryError: if it may not.
    """
    if not limit():
        return
    try:
        mmap.mmap(-1, megabytes << 20, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS).close()
    except OSError:
        raise MemoryError(f"no {megabytes} MB") from None


def limit() -> str:
    """The limit of this process in words, as in ``ulimit -v 500000``; empty if there is none."""
    try:
        import resource
    except ImportError:  # on Windows
        return ""
    for option, number in (("v", resource.RLIMIT_AS), ("d", resource.RLIMIT_DATA)):
        most = resource.getrlimit(number)[0]
        if most != resource.RLIM_INFINITY:
            return f"ulimit -{option} {most // 1024}"
    return ""


def lacking() -> str:
    """What a person can do where memory has run out."""
    if found := limit():
        return f"not enough memory within {found}: raise this limit, or take fewer --threads; what is finished is kept"
    return "not enough memory: close other programs, or take fewer --threads; what is finished is kept"


def checked(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command that begins only where there is memory for it; libraries that do not bear a limit are loaded then.

    Raises:
        EngineError: from the command, if there is not.
    """

    @wraps(command)
    def begun(*args: Any, **options: Any) -> Any:
        if (found := limit()) and "mujoco" not in sys.modules:  # a session may have loaded all of it before
            try:
                room(NEEDED)
            except MemoryError:
                said = f"not enough memory within {found}: {NEEDED} MB are needed; raise this limit"
                raise EngineError(said) from None
            _spare()
            _load()
        return command(*args, **options)

    return begun


def _spare() -> None:
    """Let threads take less: no heap of their own, and none of OpenBLAS's, which come with the cores of a machine."""
    import ctypes

    with suppress(AttributeError):  # of the GNU C library; where a heap is refused, errno confuses MuJoCo's reader
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, 1)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _load() -> None:
    """Load both copies of OpenBLAS, each with the memory that it works in."""
    import numpy as np
    from scipy.linalg.blas import dgemm

    square = np.eye(200)
    dgemm(1.0, square @ square, square)
