"""The shapes of devices and of the ends of car bodies, shortened and coloured as a collision uses them up."""

from __future__ import annotations

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.mj import mujoco
from trainmj.collision.result import Result
from trainmj.collision.wear import Wear
from trainmj.view.parts import SKIN, Body, End, ends, middle_of

_RAMP = {  # colours by share: from steel to dark red, darker for more, to every eye; after ColorBrewer's YlOrRd
    0.0: (0.74, 0.76, 0.78),
    0.04: (0.996, 0.85, 0.46),
    0.25: (0.992, 0.70, 0.30),
    0.5: (0.99, 0.45, 0.18),
    0.75: (0.84, 0.12, 0.12),
    1.0: (0.50, 0, 0.15),
}


def colour(share: float | Array) -> Array:
    """(..., 3) red, green and blue for a share of the largest energy."""
    return np.stack([np.interp(share, list(_RAMP), channel) for channel in zip(*_RAMP.values(), strict=True)], axis=-1)


def largest_energy(result: Result) -> float:
    """The largest energy that any device of a collision absorbs [J], at which the colours end."""
    return float(max(result.left_energy.max(), result.right_energy.max()))


class DeviceShapes:
    """The shapes of devices in a compiled model, and of the ends of car bodies, which follow their wear."""

    def __init__(self, model: mujoco.MjModel, chain: Chain, full: float) -> None:
        """Find them by name; full is the energy at the end of the colours [J]."""
        self._model, self._full = model, max(full, 1.0)
        self._ends = [
            (end, middle_of(chain, end.vehicle), [(part, model.geom(part.name).id) for part in end.parts])
            for end in ends(chain)
        ]
        self._bodies = [
            (end, body, [_Crumpling(model, g) for g in range(model.ngeom) if model.geom(g).name.startswith(body.name)])
            for end, *_ in self._ends
            if (body := end.body) is not None
        ]

    def show(self, wear: Wear) -> list[int]:
        """Shorten and colour every part; ids of the meshes whose corners have moved."""
        model = self._model
        for end, middle, parts in self._ends:
            stroke = wear.shown(end.interface, end.side)
            colours = self._colours(wear, end)
            for part, geom in parts:
                begin, finish = part.placed(stroke)
                model.geom_pos[geom, 0] = middle + end.direction * 0.5 * (begin + finish)
                along = 1 if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER else 0
                model.geom_size[geom, along] = 0.5 * (finish - begin)
                if part.shape.material == "device":
                    model.geom_matid[geom] = -1
                    model.geom_rgba[geom, :3] = colours[part.zone.stage]
        moved = []
        for end, body, pieces in self._bodies:
            shorter = body.shorter(wear.shown(end.interface, end.side))
            paint = self._colours(wear, end)[-1] if shorter > 0.0 else None
            moved += [piece.mesh for piece in pieces if piece.crumple(end.direction, body, shorter, paint)]
        return moved

    def _colours(self, wear: Wear, end: End) -> Array:
        """(n_stage, 3) of the device at an end."""
        return colour(wear.worn[end.interface, end.side].energy / self._full)


class _Crumpling:
    """A piece of the end of a car body."""

    def __init__(self, model: mujoco.MjModel, geom: int) -> None:
        """Look at the geom, whose corners are those of a mesh that nothing else has."""
        self._model, self._geom, self.mesh = model, geom, int(model.geom_dataid[geom])
        start = model.mesh_vertadr[self.mesh]
        self._place = slice(start, start + model.mesh_vertnum[self.mesh])
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        self._turn = turn.reshape(3, 3)
        self._whole = model.mesh_vert[self._place] @ self._turn.T + model.geom_pos[geom]
        self._shorter = 0.0
        self._look = int(model.geom_matid[geom]), model.geom_rgba[geom].copy()

    def crumple(self, direction: int, body: Body, shorter: float, paint: Array | None) -> bool:
        """Make it shorter and paint its skin; whether it has changed its length."""
        model = self._model
        if model.geom(self._geom).name.endswith(SKIN):
            model.geom_matid[self._geom], model.geom_rgba[self._geom] = self._look
            if paint is not None:
                model.geom_matid[self._geom], model.geom_rgba[self._geom, :3] = -1, paint
        if shorter == self._shorter:
            return False
        self._shorter = shorter
        corners = self._whole.copy()
        corners[:, 0] -= direction * shorter * (direction * corners[:, 0] - body.start) / (body.end - body.start)
        model.mesh_vert[self._place] = (corners - model.geom_pos[self._geom]) @ self._turn
        return True
