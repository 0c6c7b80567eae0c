"""Files that are replaced as a whole: whatever stops the program, the old file or the new one is there, complete."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from trainmj.errors import OutputError


@contextmanager
def replacing(file: str | Path) -> Iterator[Path]:
    """A path to write to, which replaces the file when the block ends without an error.

    ::

        with replacing("table.csv") as part:
            part.write_text(text)

    Args:
        file: what is made or replaced; the target, if it is a link. Devices and pipes are written to directly.

    Yields:
        The path; removed if the block fails or is interrupted.

    Raises:
        OutputError: if it cannot be written, for example because the disk is full.
    """
    direct = Path(file).is_absolute() and Path(file).parts[1:2] in (("dev",), ("proc",))
    file = Path(file) if direct else Path(os.path.realpath(file))
    direct |= file.exists() and not file.is_file() and not file.is_dir()  # a pipe somewhere else
    part = file if direct else file.with_name(f".{file.name[:200]}.{os.getpid()}.part")
    try:
        yield part
        if direct:
            return
        with part.open("rb+") as written:
            os.fsync(written.fileno())
        os.replace(part, file)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{file}: cannot be written ({error.strerror or error})") from None
    finally:
        if not direct:
            with suppress(OSError):
                part.unlink(missing_ok=True)


def write_bytes(file: str | Path, content: bytes) -> None:
    """Make or replace a file with this content.

    Raises:
        OutputError: if it cannot be written.
    """
    with replacing(file) as part:
        part.write_bytes(content)
