"""What is computed otherwise than one might read the scenario, and what there is to know about how."""

from __future__ import annotations

import math
from collections.abc import Iterator

from trainmj.collision.chain import Chain, names_in_runs, order_of_vehicles
from trainmj.collision.device import CAR_BODY
from trainmj.collision.fields import KEPT
from trainmj.collision.gear import BOGIES, SUSPENDED
from trainmj.collision.measured import Measured
from trainmj.units import KJ, KN, MM, G

_FELT = 0.1 * G  # mean acceleration that a contact may have and not be left out of a window [m/s2]
_COUNTS = 1e-3  # energy to speak of, relative to what the collision can convert


def remarks(chain: Chain) -> tuple[str, ...]:
    """One sentence for each thing to know, for every output of a collision of this chain."""
    return tuple(_of_chain(chain))


def _of_chain(chain: Chain) -> Iterator[str]:
    steep = [i.name for i in chain.interfaces if any(d.envelope.steep for d in i.devices if d.law.kind.follows)]
    if steep:
        yield (
            f"{', '.join(steep)}: the crush curve rises faster than the unloading stiffness in places; there the force "
            "climbs along the stiffness."
        )
    unstated = dict.fromkeys(d.name for i in chain.interfaces for d in i.devices if d.law.end < float("inf"))
    if unstated:
        yield (
            f"{', '.join(unstated)}: nothing is stated behind the end of the curve; where it is passed, the last force "
            "is held, and what comes later is not valid. State beyond: car_body, stop or hold."
        )

    coarse = [v.name for v in chain.vehicles if chain.contact_threshold > _FELT * v.mass]
    if coarse:
        yield (
            f"{', '.join(coarse)}: simulation.contact_threshold_kN = {chain.contact_threshold / KN:g} is more than "
            f"{_FELT / G:g} g of such a mass, so that contact windows leave much of a weak contact out; state a lower "
            "one."
        )
    if chain.flattened:
        yield (
            "Vehicles move along the track only: what the scenario states of the vertical plane, as vehicle types, "
            "lines of devices, ties, offsets and limits, has no effect. State plane: vertical to use it."
        )
    yield from _of_bodies(chain)
    yield from _of_gear(chain)


def _of_bodies(chain: Chain) -> Iterator[str]:
    """What to know of bodies that collapse."""
    weak = {i: v.body for i, v in enumerate(chain.vehicles) if v.body is not None and v.body.collapse < float("inf")}
    soft = [chain.vehicles[i].name for i, body in weak.items() if body.hardening == 0.0 and body.n_members > 1]
    if soft:
        yield (
            f"{', '.join(soft)}: the body collapses without hardening, so that one member takes all of it; what is "
            "crushed within 5 m then depends on the number of members."
        )
    twice = dict.fromkeys(
        device.name
        for i in chain.interfaces
        for device in i.devices
        if {i.left, i.right} & weak.keys() and any(stage.name == CAR_BODY for stage in device.stages)
    )
    if twice:
        yield (
            f"{', '.join(twice)}: a car body stands behind the device and is a body of its own as well; what collapses "
            "is the weaker of the two. With body: collapse_force_kN, state beyond: stop."
        )


def _of_gear(chain: Chain) -> Iterator[str]:
    """Suspensions whose springs would pull, which coil springs do not: unloaded before a lift stop acts."""
    unloaded: dict[str, dict[str, float]] = {"secondary": {}, "primary": {}}
    for i in order_of_vehicles(chain):
        gear, vehicle = chain.vehicles[i].gear, chain.vehicles[i].name
        if gear is None:
            continue
        for dof, preload in zip(SUSPENDED, gear.standing.preload, strict=True):
            suspension, of = gear.suspension(dof), unloaded["secondary" if dof in BOGIES else "primary"]
            extension = preload / suspension.stiffness
            if extension < suspension.lift_stop:
                of[vehicle] = min(extension, of.get(vehicle, math.inf))
    for name, vehicles in unloaded.items():
        if vehicles:
            yield (
                f"{names_in_runs(list(vehicles))}: the {name} springs are unloaded before their lift stop acts, when "
                f"extended by {min(vehicles.values()) / MM:.3g} mm or more. Further on they pull here, where real coil "
                "springs go loose, so that wheelsets lift off early."
            )


def remarks_of(measured: Measured) -> tuple[str, ...]:
    """What the collision of a lot of one adds to the remarks of its chain."""
    return (*_set_free(measured), *_refined(measured), *_contacts(measured))


def _set_free(measured: Measured) -> Iterator[str]:
    """What pairs of devices set free as they snapped, if that counts."""
    sides, dissipated = measured.sides, measured.tally.dissipated[0].tolist()
    energies = list(zip(sides.interfaces, sides.energy[0].tolist(), strict=True))
    for k, interface in enumerate(measured.chain.interfaces):
        pair = 2.0 if interface.equal_sides and len(interface.sides) == 1 else 1.0
        taken = pair * sum(energy for of, energy in energies if of is interface)
        lost = dissipated[k] - taken
        if lost > _COUNTS * measured.convertible[0]:
            yield (
                f"{interface.name}: {lost / KJ:.4g} kJ of the absorbed energy are in neither device: the force of one "
                "fell faster than the other could give back."
            )


def _refined(measured: Measured) -> Iterator[str]:
    """That steps were made smaller, and what it cost."""
    if measured.chain.refined:
        whole = measured.tally.time[0] / measured.chain.step
        yield (
            "A step was wider than a part of a curve, and passed a peak of it or lost the balance of energy. Steps "
            f"were made smaller there: {measured.tally.steps[0]:.0f} in place of {whole:.0f}, after a first run "
            "without."
        )


def _contacts(measured: Measured) -> Iterator[str]:
    """Contact windows that the end of the run has cut, and that there are more than are kept."""
    order = [(i, measured.chain.vehicles[i].name) for i in order_of_vehicles(measured.chain)]
    contacts = measured.tally.contacts[0]
    cut = [name for i, name in order if measured.contacts[1][0, i, -1] > 0.0]
    if cut:
        yield (
            f"{', '.join(cut)}: in contact when the run ended; the last contact window is cut off there, and its mean "
            "is that up to there."
        )
    many = [f"{name} ({contacts[i]:.0f})" for i, name in order if contacts[i] > KEPT]
    if many:
        yield (
            f"{', '.join(many)}: more contact windows than are listed, which are the first {KEPT - 1} and the worst of "
            "the others. The first and the worst mean are those of all windows."
        )
