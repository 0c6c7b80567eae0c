"""The laws of devices, a module for each kind.

A law is written once, as plain functions of a block of numbers: Python calls them as they stand, and
:mod:`~trainmj.collision.kernel` compiles them into the callback of MuJoCo. Each module that has a ``KIND`` is found
here; to add a kind, add its module and its keys in :mod:`trainmj.scenario.devices`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from importlib import import_module
from typing import Any

from trainmj.collision.fields import Block
from trainmj.collision.jitable import jitable
from trainmj.collision.kind import Kind, Response

_MODULES = (import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__))
KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in sorted(
        (module.KIND for module in _MODULES if hasattr(module, "KIND")),
        key=lambda kind: (kind.name != "crush", kind.name),
    )
}
"""Every kind by name, crush first; its place is the code by which the compiled law knows it."""

CRUSH = 0
"""The code of :mod:`~trainmj.collision.law.crush`."""

SERIES = -1
"""In place of a code, for two laws in series."""

FOLLOWED = -2
"""In place of that of crush, where it is followed through what happens to it within a step."""


def _chosen() -> Callable[[float, Block, int, float, float, float], Response]:
    """The law of an element: by its code, one comparison after the other."""

    def none(kind: float, s: Block, e: int, stroke: float, rate: float, elapsed: float) -> Any:
        return 0.0, 0.0, 0.0, 0.0, 0.0

    def before(code: int, law: Any, others: Any) -> Any:
        law = jitable(law)

        @jitable
        def respond(kind: float, s: Block, e: int, stroke: float, rate: float, elapsed: float) -> Any:
            if kind == code:
                return law(s, e, stroke, rate, elapsed)
            return others(kind, s, e, stroke, rate, elapsed)

        return respond

    found = jitable(none)
    for code, kind in reversed(list(enumerate(KINDS.values()))):
        found = before(code, kind.respond, found)
    return found


respond = _chosen()
"""``respond(kind, s, e, stroke, rate, elapsed)``: the response of an element whose law has a code."""
