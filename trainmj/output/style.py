"""The look of all figures: sizes that fit a journal, colours that every eye can tell apart, embedded fonts.

Draw under :func:`styled`, take the figure from :func:`figure` or :func:`grid`, write it with :func:`save`::

    with styled("column"):
        picture = figure(height=60)
        axes = picture.subplots()
        axes.plot(time, force, color=BLUE)
    save(picture, "out/force", ["png", "svg", "pdf"])

The same figure gives the same bytes, whatever its user has set up: no file carries a date or a random name, no
matplotlibrc is heeded, no window is opened, and pyplot stays as it is.
"""

from __future__ import annotations

import io
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

from trainmj.errors import InputError
from trainmj.files.arguments import listed
from trainmj.files.environment import variables
from trainmj.files.written import write_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

Width = Literal["column", "page"]
Format = Literal["png", "svg", "pdf"]

WIDTHS: dict[Width, float] = {"column": 84.0, "page": 174.0}
"""Widths of a figure [mm]: a column, or the page, of the narrower journals (Springer's; Elsevier has 90 and 190)."""

FORMATS: tuple[Format, ...] = get_args(Format)
"""Formats of figures."""

DPI = 300
"""Resolution of a PNG, the least that most journals take for line art with text."""

BLUE, SKY, ORANGE, GREEN, GREY = "#0072B2", "#8CC8EE", "#D55E00", "#009E73", "0.45"
YELLOW, PURPLE = "#E69F00", "#CC79A7"

PALETTE = (BLUE, ORANGE, GREEN, YELLOW, PURPLE, SKY, "#404040")
"""Okabe and Ito's colours (https://jfly.uni-koeln.de/color), which every eye can tell apart; in order of use."""

DIVERGING = (ORANGE, "#ffffff", BLUE)
"""The scale of what has a sign, such as a correlation, from its most negative value over 0 to its most positive one:
in every picture and plot."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
"""To tell lines apart in black and white too; in order of use."""

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib, so that a figure looks the same on every machine
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # titles that need not look for their place draw faster
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": False,
    "figure.titlesize": 9,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "savefig.dpi": DPI,
    "text.parse_math": False,  # a dollar in a title is a dollar
    "pdf.fonttype": 42,  # TrueType, which journals ask for and editors can change
    "svg.fonttype": "path",  # letters as shapes: right where the font is missing
    "svg.hashsalt": "trainmj",  # names inside the file do not change from run to run
}
_OF_SESSION = ("backend", "backend_fallback", "interactive")  # how windows are opened, which figures never are
_NO_DATE: dict[Format, dict[str, None]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
_MM = 1 / 25.4


ENDINGS = f"({'|'.join(FORMATS)})"
"""The endings of figures, as a pattern."""

_settings = True  # whether matplotlib is imported with its user's settings


def without_settings() -> None:
    """Import matplotlib, when it comes to that, without its user's settings: for a process of our own.

    Elsewhere somebody may draw as well and wants them; :func:`styled` sets them aside.
    """
    global _settings
    _settings = False


@cache
def _matplotlib() -> Any:
    if _settings:
        with suppress(Exception):  # a backend that is not there, a matplotlibrc that is no text
            import matplotlib

            return matplotlib
        for name in [name for name in sys.modules if name.startswith("matplotlib.")]:
            del sys.modules[name]  # they know the one that failed
    exists = os.path.exists
    try:
        os.path.exists = lambda path: path != "matplotlibrc" and exists(path)  # which it tries first
        with variables(MPLBACKEND="", MATPLOTLIBRC=os.devnull):
            import matplotlib
    finally:
        os.path.exists = exists
    with _lean():
        import matplotlib.figure
    return matplotlib


@contextmanager
def _lean() -> Iterator[None]:
    """Import figures without axes in space and without lists of properties in docstrings, which take a third of it."""
    from matplotlib import artist

    listed = artist.kwdoc
    try:
        artist.kwdoc = lambda artist: ""
        sys.modules["mpl_toolkits.mplot3d"] = None  # type: ignore[assignment]
        with warnings.catch_warnings(action="ignore"):  # that it is missing
            yield
    finally:
        artist.kwdoc = listed
        del sys.modules["mpl_toolkits.mplot3d"]


@contextmanager
def styled(width: Width = "page") -> Iterator[None]:
    """Draw in the look of trainmj, figures as wide as this unless another width is given."""
    mpl = _matplotlib()
    from cycler import cycler

    plain = {name: value for name, value in mpl.rcParamsDefault.items() if name not in _OF_SESSION}
    size = (WIDTHS[width] * _MM, WIDTHS[width] * _MM * 0.62)
    with mpl.rc_context(plain | _STYLE | {"figure.figsize": size, "axes.prop_cycle": cycler(color=PALETTE)}):
        yield


def formats_given(names: str | Sequence[str]) -> tuple[Format, ...]:
    """Formats of figures by name, each once; a single name stands for a list of it.

    Raises:
        InputError: if there is no such format.
    """
    chosen = tuple(dict.fromkeys(listed(names)))
    for name in chosen:
        if name not in FORMATS:
            raise InputError(f"figures: {name!r} is not a format of figures; known: {', '.join(FORMATS)}")
    return cast(tuple[Format, ...], chosen)


def figure(width: Width | None = None, height: float | None = None) -> Figure:
    """An empty figure, laid out so that nothing overlaps.

    Args:
        width: by default that of :func:`styled`.
        height: [mm]; by default 0.62 of the width.
    """
    from matplotlib.figure import Figure

    wide = set_width() if width is None else WIDTHS[width]
    return Figure(figsize=(wide * _MM, (height or 0.62 * wide) * _MM), layout="constrained")


def set_width() -> float:
    """The width of :func:`styled`, which figures take now [mm]."""
    import matplotlib as mpl

    return float(mpl.rcParams["figure.figsize"][0]) / _MM


def grid(n: int, height: float, most: int = 3, narrowest: float = 50.0) -> tuple[Figure, list[Axes]]:
    """A figure with n panels, as many side by side as the width holds; a single one is a column wide.

    Args:
        n: panels.
        height: of each [mm].
        most: panels side by side.
        narrowest: least width of a panel [mm].
    """
    columns = max(1, min(n, most, int(set_width() / narrowest)))
    rows = -(-n // columns)
    picture = figure("column" if n == 1 else None, height * rows)
    panels = picture.subplots(rows, columns, squeeze=False).ravel()
    for spare in panels[n:]:
        spare.remove()
    return picture, list(panels[:n])


def diverging() -> Colormap:
    """DIVERGING as matplotlib takes it; ``vmin`` and ``vmax`` must be opposite."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("diverging", DIVERGING, N=257)  # 0 is white


def encode(picture: Figure, form: Format) -> bytes:
    """A figure as the bytes of a file; the first call fixes its layout, so that all formats show the same."""
    content = io.BytesIO()
    with styled(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # an empty box shows that
        _let_powers_be_formulas(picture)
        if picture.axes and (layout := picture.get_layout_engine()) is not None:
            layout.execute(picture)  # which needs no drawing
            picture.set_layout_engine(None)  # each further pass would move it a little, and a picture be drawn twice
        picture.savefig(content, format=form, metadata=_NO_DATE[form])
    return content.getvalue()


def _let_powers_be_formulas(picture: Figure) -> None:
    """Show the numbers of logarithmic axes as powers of 10; all other text is shown as it is written."""
    from matplotlib.ticker import LogFormatter

    for axes in picture.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_formatter(), LogFormatter):
                for label in axis.get_ticklabels(which="both"):
                    label.set_parse_math(True)


def save(picture: Figure, path: str | Path, formats: Sequence[Format] = ("png",)) -> list[Path]:
    """Write a figure in each format, whole or not at all.

    Args:
        picture: the figure.
        path: of the files, without ending.
        formats: their endings.

    Returns:
        The files.

    Raises:
        OutputError: if one cannot be written.
    """
    files = [Path(f"{path}.{form}") for form in formats]
    for file, form in zip(files, formats, strict=True):
        write_bytes(file, encode(picture, form))
    return files
