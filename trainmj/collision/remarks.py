"""What is computed otherwise than one might read the scenario: dashpots in series, curves too steep."""

from __future__ import annotations

from collections.abc import Iterator

from trainmj.collision.chain import Chain, Interface
from trainmj.collision.measured import Measured
from trainmj.units import KJ, KN_S_PER_M

_COUNTS = 1e-3  # energy to speak of, relative to what the collision can convert
_ALIKE = 1e-6  # relative difference of two c/K that counts as none


def remarks(chain: Chain) -> tuple[str, ...]:
    """One sentence for each thing to know, for every output of a collision of this chain."""
    steep = [i.name for i in chain.interfaces if any(d.envelope.steep for d in i.devices)]
    found = [remark for interface in chain.interfaces for remark in _in_series(interface)]
    if steep:
        found.append(
            f"{', '.join(steep)}: the crush curve rises faster than the unloading stiffness in places; there the force "
            "climbs along the stiffness."
        )
    return tuple(found)


def set_free(measured: Measured) -> tuple[str, ...]:
    """What a pair of devices set free as it snapped, if that counts, for every output of this collision."""
    front = measured.chain.interfaces[measured.chain.front]
    if not front.unequal_sides:
        return ()
    taken = sum(side.energy for side in measured.sides if side.interface is front)
    lost = float(measured.tally.dissipated[measured.chain.front]) - taken
    if lost <= _COUNTS * measured.convertible:
        return ()
    return (
        f"{front.name}: {lost / KJ:.4g} kJ of the absorbed energy are in neither device: "
        "the force of one fell faster than the other could give back.",
    )


def _in_series(interface: Interface) -> Iterator[str]:
    """What becomes of the dashpots of two different devices."""
    if not interface.unequal_sides:
        return
    first, second = (device.envelope for device in interface.devices)
    for one, other in (interface.devices, interface.devices[::-1]):
        if one.envelope.damping and not other.envelope.damping:
            dashpot = f"the dashpot of {one.name} ({one.envelope.damping / KN_S_PER_M:.10g} kN s/m)"
            yield f"{interface.name}: {dashpot} is left out, as {other.name} in series with it has none."
    ratios = first.damping / first.stiffness, second.damping / second.stiffness
    if all(ratios) and abs(ratios[0] - ratios[1]) > _ALIKE * max(ratios):
        names = " and ".join(device.name for device in interface.devices)
        yield (
            f"{interface.name}: the dashpots of {names} act as one in series, which is exact only where c/K is the "
            "same on both sides."
        )
