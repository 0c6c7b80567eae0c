"""Results that were saved as HDF5 files, before NetCDF 3 took their place; needs the extra ``hdf5``.

The HDF5 library may loop for ever on a damaged file, or end the process. So a process of its own reads the file, with a
bound on its time, and hands over plain arrays.
"""

from __future__ import annotations

import io
import json
import signal
import subprocess
import sys
from typing import Any

import numpy as np

from trainmj.errors import InputError

BEGINNING = b"\x89HDF\r\n\x1a\n"
FORMAT = "trainmj result 1"

_SECONDS = 0.5  # of processor time for reading, several times what it takes
_SECONDS_PER_BYTE = 2e-8
_PATIENCE = 60.0  # of any time [s]: the machine may be busy
_NO_PACKAGE = 3  # exit code


def read(content: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Attributes and variables of a file, by name.

    Raises:
        InputError: if it cannot be read, without the name of the file.
    """
    words = [sys.executable, "-P", __file__]
    try:
        done = subprocess.run(words, input=content, capture_output=True, timeout=_PATIENCE, check=False)
    except (OSError, subprocess.TimeoutExpired):
        raise InputError("is not a readable NetCDF file (HDF5 does not answer)") from None
    if done.returncode == _NO_PACKAGE:
        raise InputError("is an HDF5 file of an earlier trainmj, which needs the package h5py: pip install h5py")
    try:
        if done.returncode:
            raise ValueError
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as found:
            arrays = dict(found)
        return json.loads(str(arrays.pop("/attributes"))), arrays
    except (EOFError, KeyError, TypeError, ValueError):
        raise InputError("is not a readable NetCDF file (HDF5 cannot read it, or comes to no end)") from None


def _read_here() -> None:
    """Read the file at standard input and write what it holds to standard output; end early if it is damaged."""
    try:
        import h5py
    except ImportError:
        sys.exit(_NO_PACKAGE)
    content = sys.stdin.buffer.read()
    if hasattr(signal, "setitimer"):
        most = _SECONDS + _SECONDS_PER_BYTE * len(content)
        signal.setitimer(signal.ITIMER_PROF, most)  # nothing catches its signal: it ends the process
    with h5py.File(io.BytesIO(content)) as file:
        attributes = {name: _plain(file.attrs[name]) for name in file.attrs if not name.startswith("_")}
        numbers = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset) and item.dtype != "O"}
        if sum(item.nbytes for item in numbers.values()) > len(content):
            sys.exit("claims more than it holds")
        found = {name: item[()] for name, item in numbers.items()}
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, 0)
    out = io.BytesIO()
    found["/attributes"] = np.array(json.dumps(attributes))
    np.savez(out, allow_pickle=False, **found)
    sys.stdout.buffer.write(out.getvalue())


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, (np.generic, np.ndarray)) and value.size == 1 else str(value)


if __name__ == "__main__":
    _read_here()
