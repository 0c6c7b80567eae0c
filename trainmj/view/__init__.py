"""Pictures and films of a collision, drawn by MuJoCo without a screen, and its viewer where there is one.

Films and stills come from :func:`~trainmj.view.film.render`, the viewer from :mod:`trainmj.view.viewer`.
"""

from trainmj.view.film import CAMERAS, Camera, render

__all__ = ["CAMERAS", "Camera", "render"]
