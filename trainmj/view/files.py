"""Stills and films written one picture at a time: a long film takes no more memory than a short one."""

from __future__ import annotations

import io
import struct
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import IO, Any

from PIL.Image import Image

from trainmj.files.atomic import replacing

FILMS, STILLS = (".webp", ".mp4"), (".png",)
"""Endings of what can be written."""

_QUALITY = 85  # of a WebP frame
_WAITING = 3  # frames that are being compressed while the next ones are drawn


def write_still(file: Path, image: Image) -> None:
    """Write one picture.

    Raises:
        OutputError: if it cannot be written.
    """
    with replacing(file) as part:
        image.save(part, format="PNG", optimize=True)


def write_film(file: Path, images: Iterator[Image], size: tuple[int, int], fps: float, hold: float) -> None:
    """Write a film.

    Args:
        file: .webp or .mp4.
        images: its frames.
        size: width and height [pixels].
        fps: frames a second.
        hold: how long it rests on the last frame [s].

    Raises:
        OutputError: if it cannot be written.
    """
    write = _write_webp if file.suffix.lower() == ".webp" else _write_mp4
    write(file, images, size, fps, hold)


def _write_webp(file: Path, images: Iterator[Image], size: tuple[int, int], fps: float, hold: float) -> None:
    """An animated WebP: a RIFF file with a chunk for each frame (developers.google.com/speed/webp/docs/riff_container).

    Pillow can write one too, but takes all pictures at once.
    """
    with replacing(file) as part, part.open("wb") as out:
        out.write(b"RIFF\0\0\0\0WEBP")
        out.write(_chunk(b"VP8X", bytes([0b10, 0, 0, 0]) + _three(size[0] - 1) + _three(size[1] - 1)))
        out.write(_chunk(b"ANIM", struct.pack("<IH", 0xFFFFFFFF, 0)))  # a white background, repeated for ever
        shown = 0  # until when [ms]; the sum is rounded, so that the film keeps its length
        last = None
        for number, data in enumerate(_compressed(images)):
            if last is not None:
                until = round(1000 * number / fps)
                out.write(_frame(last, size, until - shown))
                shown = until
            last = data
        if last is not None:
            out.write(_frame(last, size, round(1000 * hold)))
        length = out.tell()
        out.seek(4)
        out.write(struct.pack("<I", length - 8))


def _compressed(images: Iterator[Image]) -> Iterator[bytes]:
    """The image chunk of each picture; other threads compress while the next one is drawn."""
    with ThreadPoolExecutor(1) as pool:
        waiting: deque[Any] = deque()
        try:
            for image in images:
                waiting.append(pool.submit(_compress, image))
                if len(waiting) > _WAITING:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


def _compress(image: Image) -> bytes:
    content = io.BytesIO()
    image.save(content, format="WEBP", quality=_QUALITY, method=2)
    return content.getvalue()[12:]  # behind the RIFF header: one chunk, VP8


def _frame(data: bytes, size: tuple[int, int], duration: int) -> bytes:
    place = _three(0) + _three(0) + _three(size[0] - 1) + _three(size[1] - 1)
    return _chunk(b"ANMF", place + _three(duration) + bytes([0b10]) + data)  # replaces what was there


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def _three(number: int) -> bytes:
    return struct.pack("<I", number)[:3]


def _write_mp4(file: Path, images: Iterator[Image], size: tuple[int, int], fps: float, hold: float) -> None:
    """H.264, which every player and presentation program shows."""
    from fractions import Fraction

    av: Any = import_module("av")  # its types are incomplete
    rate = Fraction(fps).limit_denominator(1000)
    with replacing(file) as part, part.open("wb") as out:
        kept = _Kept(out)
        with av.open(kept, "w", format="mp4") as film:
            stream = film.add_stream("libx264", rate=rate, options={"crf": "20", "preset": "veryfast"})
            stream.width, stream.height = size
            stream.pix_fmt = "yuv420p"
            image = None
            for image in images:
                film.mux(stream.encode(av.VideoFrame.from_image(image)))
                kept.check()
            for _ in range(round(hold * fps) if image is not None else 0):
                film.mux(stream.encode(av.VideoFrame.from_image(image)))
            film.mux(stream.encode())
        kept.check()


class _Kept:
    """An open file that keeps its first error, which FFmpeg would hide behind an error of its own."""

    def __init__(self, out: IO[bytes]) -> None:
        self._out = out
        self._error: OSError | None = None
        self.seek, self.tell = out.seek, out.tell

    def write(self, content: bytes) -> int:
        if self._error is None:
            try:
                self._out.write(content)
            except OSError as error:
                self._error = error
        return len(content)

    def check(self) -> None:
        """Raise what was kept."""
        if self._error is not None:
            raise self._error
