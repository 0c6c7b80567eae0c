"""What each device of the moving train has used of its stroke, and taken of the energy, as bars beside their limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trainmj.collision.chain import Chain, n_own_sides, places_of_sides
from trainmj.collision.device import CAR_BODY, Device
from trainmj.collision.quantities import INTERFACE, STAGE
from trainmj.collision.records import InterfaceMetrics, StageUse
from trainmj.collision.summary import Summary
from trainmj.output.blocks import Bar, Section
from trainmj.output.table import Verdict, failed, judged
from trainmj.scenario.devices import DEVICE
from trainmj.units import KJ, readable

_MOST = 8  # interfaces, those nearest to the impact; others only if they pass a limit
_ENERGY = next(q for q in INTERFACE if q.key == "energy")


def add_used(section: Section, chain: Chain, summary: Summary) -> None:
    """Put the bars of strokes and energies into a section."""
    shown = list(_shown(chain, summary))
    strokes = [bar for interface, _ in shown for bar in _strokes(interface, summary.not_valid)]
    energies = [_energy(interface, device, summary.not_valid) for interface, device in shown]
    own = summary.interfaces[: n_own_sides(chain)]
    left_out = len(own) - sum(interface in own for interface, _ in shown)
    more = f" {left_out} interfaces further back, which keep their limits, are in the tables." if left_out else ""
    side = "At the front: one train's side." if chain.interfaces[chain.front].equal_sides else ""
    mark = "The mark is the limit." if any(bar.limit for bar in strokes) else "No limit is stated."
    section.bars(strokes, "Stroke used", "mm", f"{mark} {side}{more}".rstrip(), half=True)
    mark = "The mark is what the device can take at rest up to its stroke limit." * any(bar.limit for bar in energies)
    section.bars(energies, "Energy absorbed", "kJ", f"{mark} {side}{more}".strip(), half=True)


def _shown(chain: Chain, summary: Summary) -> Iterator[tuple[InterfaceMetrics, Device]]:
    """The interfaces of the moving train nearest to the impact, and all under test that pass a limit."""
    for n, (interface, (k, side)) in enumerate(zip(summary.interfaces, places_of_sides(chain), strict=True)):
        past = interface.judged and (
            interface.beyond_curve or any(s.exhausted or s.collapsed for s in interface.stages)
        )
        if n < min(_MOST, n_own_sides(chain)) or past:
            yield interface, chain.interfaces[k].devices[side]


def _strokes(interface: InterfaceMetrics, not_valid: str) -> Iterator[Bar]:
    """Each stage of a device with its limit; without a car body that nothing reached."""
    stages = [s for s in interface.stages if s.name != CAR_BODY or s.stroke_mm > 0.0]
    for stage in stages:
        name = f"{interface.name} {interface.device if stage.name == DEVICE else stage.name}"
        said = STAGE.text(stage.stroke_mm, stage.limit_mm)
        if stage.limit_mm is not None:
            said += f" of {stage.limit_mm:.12g}"
        yield Bar(name, stage.stroke_mm, stage.limit_mm, said, _verdict(stage, interface.judged, not_valid))


def _verdict(stage: StageUse, under_test: bool, not_valid: str) -> Verdict | None:
    if not_valid:
        return failed("not valid")
    if stage.collapsed and under_test:
        return failed("gave way")
    return judged(not stage.exhausted) if stage.limit_mm is not None and under_test else None


def _energy(interface: InterfaceMetrics, device: Device, not_valid: str) -> Bar:
    energy, most = interface.energy_kJ, capacity(device)
    said = _ENERGY.text(energy) + (f" of {readable(most / KJ, 1)}" if most is not None else "")
    verdict = failed("not valid") if not_valid else None
    return Bar(f"{interface.name} {interface.device}", energy, None if most is None else most / KJ, said, verdict)


def capacity(device: Device) -> float | None:
    """Energy that a device takes at rest up to the last of its stroke limits [J].

    None where none is stated, or the area below its curve is not what it absorbs.
    """
    limited = [stage.start + stage.limit for stage in device.stages if np.isfinite(stage.limit)]
    if not limited or not device.law.kind.follows:
        return None
    return device.envelope.energy(max(limited))
