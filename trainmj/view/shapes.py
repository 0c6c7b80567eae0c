"""The shapes of devices and of car bodies, shortened and coloured as a collision uses them up."""

from __future__ import annotations

import numpy as np

from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.mj import mujoco
from trainmj.collision.result import Result
from trainmj.collision.wear import GIVEN, Wear
from trainmj.view.parts import SHADE, SKIN, End, ends, middle_of

_RAMP = {  # colours by share: from steel to dark red, darker for more, to every eye; after ColorBrewer's YlOrRd
    0.0: (0.74, 0.76, 0.78),
    0.04: (0.996, 0.85, 0.46),
    0.25: (0.992, 0.70, 0.30),
    0.5: (0.99, 0.45, 0.18),
    0.75: (0.84, 0.12, 0.12),
    1.0: (0.50, 0, 0.15),
}


_UNSEEN = 5e-4  # a piece of a body that has changed by less is left as it is [m]


def colour(share: float | Array) -> Array:
    """(..., 3) red, green and blue for a share of the largest energy."""
    return np.stack([np.interp(share, list(_RAMP), channel) for channel in zip(*_RAMP.values(), strict=True)], axis=-1)


def largest_energy(result: Result) -> float:
    """The largest energy that any device, or member of a body, of a collision absorbs [J], at which the colours end."""
    return float(max(result.left_energy.max(), result.right_energy.max(), result.member_yielded.max(initial=0.0)))


class Shapes:
    """The shapes of devices and car bodies in a compiled model, which follow their wear."""

    def __init__(self, model: mujoco.MjModel, chain: Chain, full: float) -> None:
        """Find them by name; full is the energy at the end of the colours [J]."""
        self._model, self._full = model, max(full, 1.0)
        self._ends = [
            (end, middle_of(chain, end.point), [(part, model.geom(part.name).id) for part in end.parts])
            for end in ends(chain)
        ]
        self._heights = model.geom_pos[:, 2].copy()
        turning = [g for *_, parts in self._ends for part, g in parts if part.zone.pin is not None]
        model.geom_sameframe[turning] = 0  # of those that lie along their body MuJoCo would take its frame
        self._shades = [
            _Shade(model, model.geom(f"{v.name} {SHADE}").id, v.gear.offset, chain.first_dof[i])
            for i, v in enumerate(chain.vehicles)
            if v.gear is not None
        ]
        self._pieces: list[tuple[_Piece, End | None, int | None]] = []
        for g in range(model.ngeom):
            name = model.geom(g).name
            of = next((one for one, *_ in self._ends if one.body and name.startswith(f"{one.body.name} ")), None)
            member = next((k for k, m in enumerate(chain.members) if m.span and f"{m.name} " in name), None)
            if member is not None:
                self._pieces.append((_Piece(model, g, chain, chain.members[member].left), of, member))
            elif of is not None:
                self._pieces.append((_Piece(model, g, chain, of.point), of, None))

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
                if part.zone.pin is not None:
                    turned = wear.turned(end.interface, part.zone.path, end.side)
                    self._turn(geom, middle + end.direction * part.zone.pin, turned)
                if part.shape.material == "device":
                    model.geom_matid[geom] = -1
                    model.geom_rgba[geom, :3] = colours[part.zone.stage]
        for shade in self._shades:
            shade.lie(wear.dof)
        given = self._given(wear)
        moved = []
        for piece, of, member in self._pieces:
            shorter = 0.0 if of is None or of.body is None else of.body.shorter(wear.shown(of.interface, of.side))
            paint = None
            if of is not None and shorter > 0.0:
                paint = self._colours(wear, of)[-1]
            elif member is not None:
                paint = given[member]
            moved += [piece.mesh] if piece.follow(wear.moved, of, shorter, paint) else []
        return moved

    def _turn(self, geom: int, pin: float, angle: float) -> None:
        """Turn a part of a strut, which lies along the vehicle, about its pin [m] by an angle [rad]."""
        model, ahead = self._model, self._model.geom_pos[geom, 0] - pin
        model.geom_pos[geom, 0] = pin + ahead * np.cos(angle)
        model.geom_pos[geom, 2] = self._heights[geom] + ahead * np.sin(angle)
        upright = 0.5 * np.pi if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER else 0.0
        model.geom_quat[geom] = _pitched(angle - upright)

    def _given(self, wear: Wear) -> list[Array | None]:
        """(n_member,) the colours of members of bodies that have given way, or have been drawn out."""
        yielded = colour(wear.yielded / self._full)
        return [paint if abs(p) > GIVEN else None for paint, p in zip(yielded, wear.plastic, strict=True)]

    def _colours(self, wear: Wear, end: End) -> Array:
        """(n_stage, 3) of the device at an end."""
        return colour(wear.worn[end.interface, end.side].energy / self._full)


def _pitched(angle: float) -> Array:
    """(4,) the rotation by a pitch, positive with the end at +x up [rad]."""
    return np.array([np.cos(0.5 * angle), 0.0, -np.sin(0.5 * angle), 0.0])


class _Shade:
    """The shadow of a vehicle in the vertical plane, which stays on the ground as the vehicle heaves and pitches."""

    def __init__(self, model: mujoco.MjModel, geom: int, offset: float, dof: int) -> None:
        """Look at the geom of a vehicle that stands higher by an offset [m], with its first degree of freedom."""
        self._model, self._geom, self._offset, self._dof = model, geom, offset, dof
        self._place, self._quat = model.geom_pos[geom].copy(), model.geom_quat[geom].copy()

    def lie(self, dof: Array) -> None:
        """Undo heave and pitch of the vehicle."""
        _, z, pitch = dof[self._dof : self._dof + 3]
        x, y, height = self._place - [0.0, 0.0, self._offset + z]
        sine, cosine = np.sin(pitch), np.cos(pitch)
        self._model.geom_pos[self._geom] = x * cosine + height * sine, y, height * cosine - x * sine
        mujoco.mju_mulQuat(self._model.geom_quat[self._geom], _pitched(-pitch), self._quat)


class _Piece:
    """A piece of a car body, in front of its wheels or of a member."""

    def __init__(self, model: mujoco.MjModel, geom: int, chain: Chain, point: int) -> None:
        """Look at the geom, whose corners are those of a mesh that nothing else has, held by a point of the chain."""
        self._model, self._geom, self.mesh = model, geom, int(model.geom_dataid[geom])
        start = model.mesh_vertadr[self.mesh]
        self._place = slice(start, start + model.mesh_vertnum[self.mesh])
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        self._turn = turn.reshape(3, 3)
        self._whole = model.mesh_vert[self._place] @ self._turn.T + model.geom_pos[geom]
        self._middle, self._point = middle_of(chain, point), point
        vehicle = chain.points[point].vehicle
        self._points = slice(chain.edge(vehicle, 0), chain.edge(vehicle, 1) + 1)
        self._places = np.array([-middle_of(chain, p) for p in range(self._points.start, self._points.stop)])
        self._back = np.zeros(len(self._whole))  # how far each corner has gone, seen from the point [m]
        self._look = int(model.geom_matid[geom]), model.geom_rgba[geom].copy()

    def follow(self, moved: Array, end: End | None, shorter: float, paint: Array | None) -> bool:
        """Go with the points of the body, and paint its skin; whether it has changed its length.

        Args:
            moved: (n_point,) how far points have moved [m].
            end: of which it is a piece, if it is.
            shorter: by how much that is shorter [m].
            paint: of the skin; None for its own look.
        """
        model = self._model
        if model.geom(self._geom).name.endswith(SKIN):
            model.geom_matid[self._geom], model.geom_rgba[self._geom] = self._look
            if paint is not None:
                model.geom_matid[self._geom], model.geom_rgba[self._geom, :3] = -1, paint
        at = self._whole[:, 0] - self._middle
        back = np.zeros_like(at)
        if end is not None and end.body is not None:
            back -= end.direction * shorter * (end.direction * at - end.body.start) / (end.body.end - end.body.start)
        back += np.interp(at + back, self._places, moved[self._points] - moved[self._point])
        if np.abs(back - self._back).max() < _UNSEEN:
            return False
        self._back = back
        corners = self._whole.copy()
        corners[:, 0] += back
        model.mesh_vert[self._place] = (corners - model.geom_pos[self._geom]) @ self._turn
        return True
