"""What a notebook shows of a thing: its own tables and figures, which are made in rooms above those of most things."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MADE_IN = "trainmj.notebook"


class Shown:
    """Has tables of its own in a notebook."""

    def _repr_html_(self) -> str:
        """What a notebook shows for the last line of a cell."""
        html: str = import_module(_MADE_IN).html_of(self)
        return html


class Drawn(Shown):
    """Has figures of its own too."""

    def plot(self, name: str = "", width: str = "page") -> Figure:
        """A figure, as the command writes it into its folder.

        Args:
            name: of the file without its ending, such as "collision"; the first one by default.
            width: that of a journal's page or column, "page" or "column".

        Returns:
            A matplotlib figure, which a notebook shows.

        Raises:
            InputError: if there is no such figure here; the message names those that there are.
        """
        figure: Any = import_module(_MADE_IN).figure_of(self, name, width)
        return figure  # type: ignore[no-any-return]
