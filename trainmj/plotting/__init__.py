"""Figures: of a collision in :mod:`~trainmj.plotting.histories`, of a study in :mod:`~trainmj.plotting.study`.

One look for all of them, from :mod:`~trainmj.plotting.style`.
"""

from trainmj.plotting.histories import collision
from trainmj.plotting.style import FORMATS, Format, Width, encode, figure, save, styled

__all__ = ["FORMATS", "Format", "Width", "collision", "encode", "figure", "save", "styled"]
