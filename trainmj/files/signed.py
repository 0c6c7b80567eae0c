"""The checksum of all bytes of a NetCDF file, which it has in an attribute of its own."""

from __future__ import annotations

import re
from hashlib import sha256

CHECKSUM = "sha256"
"""Name of the attribute."""

UNSIGNED = "0" * 64
"""What it says before there is a checksum."""

_PLACE = re.compile(rb"(sha256\0\0\0\0\0\x02\0\0\0\x40)[0-9a-f]{64}")  # the attribute: name, type, length, text


def signed(content: bytes) -> bytes:
    """A file with the checksum of all its bytes in the place for it, which itself counts as zeros.

    Raises:
        ValueError: if it has no place for it.
    """
    begin, end = _place_in(content)
    return b"".join([content[:begin], _checksum_of(content), content[end:]])


def is_intact(content: bytes) -> bool:
    """Whether the checksum of a file is that of its bytes.

    Raises:
        ValueError: if it has none.
    """
    begin, end = _place_in(content)
    return content[begin:end] == _checksum_of(content)


def _checksum_of(content: bytes) -> bytes:
    """The checksum that belongs into a file; nothing of it is copied."""
    (begin, end), whole = _place_in(content), memoryview(content)
    found = sha256(whole[:begin])
    found.update(UNSIGNED.encode())
    found.update(whole[end:])
    return found.hexdigest().encode()


def _place_in(content: bytes) -> tuple[int, int]:
    """Where the checksum begins and ends."""
    found = _PLACE.search(content)
    if not found:
        raise ValueError("it has no checksum")
    return found.end() - len(UNSIGNED), found.end()
