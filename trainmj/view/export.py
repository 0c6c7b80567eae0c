"""The model of a collision as an MJCF file, for MuJoCo's own programs."""

from __future__ import annotations

import re

from trainmj.collision.chain import Chain
from trainmj.collision.model import plateau
from trainmj.units import KN, KN_PER_MM
from trainmj.view.scene import visible


def export(chain: Chain, title: str = "") -> str:
    """The model as MJCF text that MuJoCo's own programs can run.

    MJCF cannot hold the device law. MuJoCo's elasto-plastic tendons take its place, with one plateau for each
    interface (:func:`~trainmj.collision.model.plateau`). The file has no room for the law's block, so the two never
    act together.

    Args:
        chain: what to model.
        title: for the comment at the top.
    """
    exported = visible(chain, stand_in=True)
    lines = [
        f"       {i.name}: {plateau(i) / KN:.0f} kN, {i.envelope.stiffness / KN_PER_MM:.6g} kN/mm"
        for i in chain.interfaces
    ]
    comment = (
        f"<!-- {_comment_text(title)}\n"
        "     Written by trainmj. Start from the keyframe 'start', which has both trains at speed: in MuJoCo's\n"
        "     viewer, section Simulation, Load key. The couplers, crush tubes and anti-climbers of the scenario are\n"
        "     NOT in this file: MJCF cannot express their curves, shear-off, empty strokes and dashpots. Stand-ins\n"
        "     take their place, one plateau each: ideal elasto-plastic tendons (springyield, of MuJoCo 4.0) that\n"
        "     push and never pull, with the unloading stiffness of the device and its mean force up to its stroke\n"
        "     limit. Rail friction is left out. Strokes and accelerations differ from those of trainmj.\n"
        + "\n".join(lines)
        + " -->\n"
    )
    return comment + str(exported.to_xml())


def _comment_text(title: str) -> str:
    words = " ".join(re.sub("-{2,}", "-", title).split())  # XML forbids two dashes in a comment
    return words or "Train collision"
