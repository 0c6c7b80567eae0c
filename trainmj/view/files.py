"""Stills and films written one picture at a time: a long film takes no more memory than a short one."""

from __future__ import annotations

import io
import struct
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

from PIL.Image import Image

from trainmj.files.written import replacing

FILMS, STILLS = (".webp", ".mp4"), (".png",)
"""Endings of what can be written."""

_HOLD = 1.0  # how long a film rests on its last frame [s]
_QUALITY = 85  # of a WebP frame
_WAITING = 3  # frames that are being compressed while the next ones are drawn


def write_still(file: Path, image: Image) -> None:
    """Write one picture, whole or not at all."""
    with replacing(file) as part:
        image.save(part, format="PNG", optimize=True)


def write_film(file: Path, images: Iterator[Image], n: int, size: tuple[int, int], fps: float) -> None:
    """Write a film of n images, .webp or .mp4, whole or not at all; size in pixels."""
    write = _write_webp if file.suffix.lower() == ".webp" else _write_mp4
    with replacing(file) as part:
        write(part, images, n, size, fps)


def _write_webp(part: Path, images: Iterator[Image], n: int, size: tuple[int, int], fps: float) -> None:
    """An animated WebP: a RIFF file with a chunk for each frame (developers.google.com/speed/webp/docs/riff_container).

    Pillow can write one too, but takes all pictures at once.
    """
    starts = [round(1000 * k / fps) for k in range(n)]  # [ms]; sums are rounded, so that the film keeps its length
    durations = [*(after - before for before, after in pairwise(starts)), round(1000 * _HOLD)]
    with part.open("wb") as out:
        out.write(b"RIFF\0\0\0\0WEBP")
        out.write(_chunk(b"VP8X", bytes([0b10, 0, 0, 0]) + _three(size[0] - 1) + _three(size[1] - 1)))
        out.write(_chunk(b"ANIM", struct.pack("<IH", 0xFFFFFFFF, 0)))  # a white background, repeated for ever
        for data, duration in zip(_compressed(images), durations, strict=True):
            place = _three(0) + _three(0) + _three(size[0] - 1) + _three(size[1] - 1)
            out.write(_chunk(b"ANMF", place + _three(duration) + bytes([0b10]) + data))  # replaces what was there
        length = out.tell()
        out.seek(4)
        out.write(struct.pack("<I", length - 8))


def _compressed(images: Iterator[Image]) -> Iterator[bytes]:
    """The image chunk of each picture; another thread compresses while the next one is drawn."""
    with ThreadPoolExecutor(1) as pool:
        waiting: deque[Any] = deque()
        for image in images:
            waiting.append(pool.submit(_compress, image))
            if len(waiting) > _WAITING:
                yield waiting.popleft().result()
        for last in waiting:
            yield last.result()


def _compress(image: Image) -> bytes:
    content = io.BytesIO()
    image.save(content, format="WEBP", quality=_QUALITY, method=2)
    return content.getvalue()[12:]  # behind the RIFF header: one chunk, VP8


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def _three(number: int) -> bytes:
    return struct.pack("<I", number)[:3]


def _write_mp4(part: Path, images: Iterator[Image], n: int, size: tuple[int, int], fps: float) -> None:
    """H.264, which every player and presentation program shows."""
    av: Any = import_module("av")  # its types are incomplete
    with av.open(str(part), "w", format="mp4") as film:
        rate = Fraction(fps).limit_denominator(1000)
        stream = film.add_stream("libx264", rate=rate, options={"crf": "20", "preset": "veryfast"})
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        for k, image in enumerate(images, 1):
            for _ in range(1 if k < n else 1 + round(_HOLD * fps)):
                film.mux(stream.encode(av.VideoFrame.from_image(image)))
        film.mux(stream.encode())
