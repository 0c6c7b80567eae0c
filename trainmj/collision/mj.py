"""MuJoCo, wherever it is used: on import it loads what MUJOCO_GL names to draw with, and here nothing is drawn."""

from trainmj.files.environment import variables

try:
    import mujoco
except Exception:  # noqa: BLE001 of the library that draws; if MuJoCo itself is broken, it says so now
    with variables(MUJOCO_GL="disable"):
        import mujoco
import mujoco.batch

__all__ = ["mujoco"]
