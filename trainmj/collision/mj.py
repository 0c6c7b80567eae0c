"""MuJoCo, wherever it is used, and nobody else in it.

On import it loads what MUJOCO_GL names to draw with; here nothing is drawn. Its callbacks are those of the whole
process, in which others may have set some.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from trainmj.files.environment import variables

try:
    import mujoco
except Exception:  # noqa: BLE001 of the library that draws; if MuJoCo itself is broken, it says so now
    with variables(MUJOCO_GL="disable"):
        import mujoco

__all__ = ["SLOTS", "Shared", "mujoco", "put", "undisturbed"]

_OURS = ("mjcb_passive", "mjcb_sensor", "mjcb_time", "mju_user_warning")
_OTHERS = sorted({name[4:] for name in dir(mujoco) if name.startswith("set_mjcb_")} - set(_OURS))
SLOTS: tuple[tuple[Callable[[], Any], Callable[[Any], None]], ...] = tuple(
    (getattr(mujoco, f"get_{name}"), getattr(mujoco, f"set_{name}")) for name in (*_OURS, *_OTHERS)
)
"""How to get and set each callback, first those that the device law fills."""


def put(functions: Sequence[Any]) -> None:
    """Fill the first slots and empty the others."""
    for (_, put_one), function in zip_longest(SLOTS, functions):
        put_one(function)


@dataclass
class Shared:
    """What is done for the first of several blocks, nested or in several threads, and undone after the last."""

    do: Callable[[], None]
    undo: Callable[[], None]
    users: int = 0

    @contextmanager
    def held(self) -> Iterator[None]:
        """A block."""
        with _lock:
            if self.users == 0:
                self.do()
            self.users += 1
        try:
            yield
        finally:
            with _lock:
                self.users -= 1
                if self.users == 0:
                    self.undo()


def _set_aside() -> None:
    _before[:] = [get() for get, _ in SLOTS]
    put([])


_lock = threading.Lock()
_before: list[Any] = []
_silence = Shared(_set_aside, lambda: put(_before))


@contextmanager
def undisturbed() -> Iterator[None]:
    """Use MuJoCo without anyone's callbacks, under which it compiles no model if they are in Python."""
    with _silence.held():
        yield
