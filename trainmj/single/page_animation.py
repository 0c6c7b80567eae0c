"""A side view of the collision that plays in the page: devices and bodies shorten, coloured by what they absorbed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from trainmj.collision.chain import Chain
from trainmj.collision.envelope import Array
from trainmj.collision.result import Result
from trainmj.collision.wear import GIVEN, Wear
from trainmj.output.blocks import Section, as_json
from trainmj.output.plot import VIRIDIS, numbers
from trainmj.units import KJ, KM_H, MM, enough

_MOST_CARS = 7  # vehicles of each side that are drawn, those nearest to the impact
_FRAMES = 240
_RISES = (
    " How far the ends of vehicles and the wheelsets have risen is at the scale of the height of the vehicles, or "
    "three times as much where you choose so. As vehicles are drawn short, they look steeper than they are."
)
_BODIES = " members of bodies take the colour of what they have lost by yielding;"
_HEIGHTS = (
    '<label>Heights <select class="heights"><option value="1" selected>1 x</option>'
    '<option value="3">3 x</option></select></label>\n'
)
_SEEN = 2e-3  # shortening of a body from which on it is drawn [m]
_TEMPLATES = Path(__file__).resolve().parent / "templates"


def add_animation(section: Section, result: Result) -> None:
    """Put the animation of a collision into a section of a page.

    A script in the page may call ``redraw`` of the figure with the :func:`animation_data` of another collision.
    """
    content = animation_data(result)
    markup, script = ((_TEMPLATES / f"animation.{end}").read_text(encoding="utf-8") for end in ("html", "js"))
    markup = markup.replace("BODIES", _BODIES if any(content["bodies"]) else "")
    markup = markup.replace("HEIGHTS\n", _HEIGHTS if result.chain.plane else "")
    data = as_json(content)
    section.raw(Markup(markup.replace("DATA", data)), script, data)
    left_out = len(result.chain.vehicles) - len(content["vehicles"])
    few = {0: "", 1: " 1 vehicle further away is left out."}
    section.text(
        "Not to scale: strokes are enlarged, and each device"
        + (" or body" if any(content["bodies"]) else "")
        + " is as long as its stroke needs. The view follows the "
        "place of the impact, and the sleepers pass below it."
        + (_RISES if result.chain.plane else "")
        + few.get(left_out, f" {left_out} vehicles further away are left out.")
    )


def animation_data(result: Result) -> dict[str, Any]:
    """What the script needs: names, and strokes, energies, speeds and the place of the impact at evenly spaced times.

    An interface has a stroke as a whole, and stroke and energy of each device, one or one of each side. A body that
    shortens to be seen has members, along the track, with what they are shorter and the energy lost by yielding. In the
    vertical plane the left and the right end of a vehicle rise, and each wheelset, from left to right.
    """
    chain = result.chain
    n = len(chain.vehicles)
    cars = range(max(0, chain.n_moving - _MOST_CARS), min(n, chain.n_moving + _MOST_CARS))
    joints = [k for k, i in enumerate(chain.interfaces) if i.left in cars and (i.right < 0 or i.right in cars)]
    frames = np.unique(np.linspace(0, len(result.time) - 1, _FRAMES).round().astype(int))
    every = _devices(result, frames)
    devices = [every[k] for k in joints]
    bodies = [_members(result, i, frames) for i in cars]
    parts = [part for group in (*devices, *bodies) for part in group]
    most = max(float(np.nan_to_num(energy).max(initial=0.0)) for _, energy in parts)
    return {
        "time": numbers(result.time[frames]),
        "vehicles": [chain.vehicles[i].name for i in cars],
        "drawings": [chain.vehicles[i].drawing for i in cars],
        "moving": chain.n_moving - cars.start,
        "valid_until": result.tally.valid_until if result.not_valid else None,
        "wall": chain.interfaces[chain.front].right < 0,
        "obstacle": chain.obstacle.drawing if chain.obstacle is not None else "",
        "interfaces": [chain.interfaces[k].name for k in joints],
        "front": joints.index(chain.front),
        "stroke": [numbers(result.stroke[frames, k] / MM) for k in joints],
        "devices": [_parts(sides) for sides in devices],
        "bodies": [_parts(members) for members in bodies],
        "rises": [_rises(result, i, frames) for i in cars] if chain.plane else [],
        "wheels": [_wheels(result, i, frames) for i in cars] if chain.plane else [],
        "largest_energy": float(f"{max(most, 1e-6):.4g}"),
        "digits": enough(0, most),
        "speed": [numbers(result.velocity[frames, i] / KM_H, 4) for i in cars],
        "impact": numbers(_impact(chain, result.position[frames]) / MM),
        "colours": VIRIDIS,
    }


def _parts(parts: list[tuple[Array, Array]]) -> list[dict[str, Any]]:
    return [{"stroke": numbers(stroke), "energy": numbers(energy, 4)} for stroke, energy in parts]


def _members(result: Result, vehicle: int, frames: Array) -> list[tuple[Array, Array]]:
    """Of each member of a body, from left to right, (n_frame,) shortening [mm] and energy lost by yielding [kJ].

    None where the body does not shorten enough to be seen; no energy where the member has not given way to be seen.
    """
    if np.abs(result.body_shortening[:, vehicle]).max() < _SEEN:
        return []
    given = np.abs(result.member_plastic) > GIVEN
    shortening, energy = result.member_shortening / MM, np.where(given, result.member_yielded, 0.0) / KJ
    return [(shortening[frames, k], energy[frames, k]) for k in result.chain.members_of(vehicle)]


def _rises(result: Result, vehicle: int, frames: Array) -> list[list[float | None]]:
    """How far the left and the right end of a vehicle have risen from the design (n_frame,) [mm]; none if it slides."""
    chain, gear = result.chain, result.chain.vehicles[vehicle].gear
    if gear is None:
        return []
    _, z, pitch = result.dof[frames, chain.first_dof[vehicle] :][:, :3].T
    return [_tenths(gear.offset + z + arm * np.sin(pitch)) for arm in chain.end_arms(vehicle)]


def _wheels(result: Result, vehicle: int, frames: Array) -> list[list[float | None]]:
    """How far each of its wheelsets has risen from where it stands at rest (n_frame,) [mm]."""
    own = [n for n, (i, _) in enumerate(result.chain.wheelsets) if i == vehicle]
    return [_tenths(result.wheel_rise[frames, n]) for n in own]


def _tenths(rise: Array) -> list[float | None]:
    return numbers(np.round(rise / MM, 1))


def _devices(result: Result, frames: Array) -> list[list[tuple[Array, Array]]]:
    """Of each device of each interface, (n_frame,) strokes, the permanent set at least [mm], and energies [kJ].

    A stroke is negative where a draw gear holds vehicles together that are drawn apart.
    """
    chain = result.chain
    found: list[list[tuple[Array, Array]]] = [[] for _ in chain.interfaces]
    for (k, side), stroke in Wear(chain).history(result).items():
        both = 2.0 if chain.interfaces[k].is_shared else 1.0
        found[k].append((both * stroke[frames] / MM, result.of_device("energy", k, side)[frames] / KJ))
    return found


def _impact(chain: Chain, position: Array) -> Array:
    """(n,) where the impact is along the track [m]."""
    left = position[:, chain.front]
    right = chain.interfaces[chain.front].right
    return np.zeros_like(left) if right < 0 else 0.5 * (left + position[:, right])
