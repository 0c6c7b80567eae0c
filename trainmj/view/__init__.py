"""Pictures and films of a collision, drawn without a screen; MuJoCo's viewer; and the model as an MJCF file.

Films and stills come from :func:`~trainmj.view.film.render`, the viewer from :mod:`trainmj.view.viewer`, and MJCF from
:func:`trainmj.view.scene.export`.
"""

from trainmj.view.cameras import CAMERAS, Camera
from trainmj.view.film import render

__all__ = ["CAMERAS", "Camera", "render"]
