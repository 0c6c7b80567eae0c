"""JSON files with a digest of what they say, so that damage and edits are found when they are read again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from typing import Any

from trainmj.files.text import from_json

_DIGEST = "digest"


def sealed(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values that JSON can hold, with their digest behind them."""
    return {**values, _DIGEST: _digest_of(values)}


def unsealed(content: bytes) -> dict[str, Any]:
    """The values in a file of :func:`sealed` values.

    Raises:
        ValueError: if it is not as it was written.
    """
    try:
        values = from_json(content)
    except ValueError:
        values = None
    if not isinstance(values, dict) or values.pop(_DIGEST, None) != _digest_of(values):
        raise ValueError("is damaged, or was changed by hand")
    return values


def _digest_of(values: Mapping[str, Any]) -> str:
    return sha256(json.dumps(values).encode()).hexdigest()
