"""From a chain to a deck: which springs, in series and side by side, do what a law does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from trainmj.collision.chain import WALL, Chain, Element, Interface
from trainmj.collision.envelope import Array, Envelope
from trainmj.collision.kind import Law
from trainmj.collision.law.rate import LINEAR
from trainmj.errors import InputError
from trainmj.exchange.deck import Crush, Curve, Deck, Elastic, Friction, Hysteresis, Linear, Load, Node
from trainmj.exchange.writing import plain
from trainmj.units import MM

_STEP = 1e-5  # where nothing wants a smaller one [s]
_FINE = 1e-6  # where there are small masses between springs [s]
_HALVINGS = 6  # of that, at most
_SHARE = 0.003  # of the mass of its vehicle that a node between springs may have
_DAMPED = 0.5  # dashpot times step over mass, at most; unstable from 2 on
_SWUNG = 0.05  # stiffness times step squared over mass, likewise; unstable from 4 on
_STIFF = 100.0  # times the stiffness of a device with a dashpot: that of its slider, which must not spring back
_RIGID = 20.0  # times the stiffness of what is in series with it: that of a slider which does not spring back
_SLIP = 1e-6  # closure at which rail friction is whole [m]
_WIDTH = 1e-7  # least from one point of a curve to the next [m]
_APART = 20.0  # least from one vehicle to the next as they are drawn: springs must not be turned round [m]
_NEAR = 1.0  # from a node between springs to the vehicle that it goes with, likewise [m]
_HEAVY = 1e6  # mass of the wall and the ground, which do not move [kg]
_GROUND = 1000.0  # to the ground, behind the last vehicle, likewise [m]
_RATE_POINTS = 24  # of the curve of a factor over the rate
_TURN = 0.02  # slip rate within which a force goes from one curve to the other, where only rates can tell [m/s]
_STANDS = 1e-4  # closure behind the travel of a device over which its unloading curve goes up to the other one [m]
_PRESSED = 0.005  # rate at which a preload without gas is whole [m/s]
_BACK = 0.01  # part of what a rate adds that holds its node back where the device lets go
_HELD = 10.0  # friction that holds a plunger where it is [N]
_CONTACT = 10.0  # times the stiffest part of a device: that of the contact with its plunger


def assembled(chain: Chain, title: str = "", slips: bool = True) -> Deck:
    """A chain as nodes and springs.

    Args:
        chain: what moves along the track only.
        title: of the deck.
        slips: whether the program has springs that slip between two curves.

    Raises:
        InputError: if draw gear has a dashpot.
    """
    deck = _Assembly(chain, title, slips, _STEP).deck
    if any(node.vehicle and node.name != node.vehicle for node in deck.nodes[len(chain.points) :]):
        step = _FINE
        for _ in range(_HALVINGS):
            made = _Assembly(chain, title, slips, step)
            if made.heaviest <= _SHARE:
                break
            step /= 2
        deck = made.deck
    return deck


@dataclass(frozen=True)
class _Between:
    """Where a device acts: between two nodes, from a closure on, with so many times its own stroke.

    Attributes:
        left: place of a node.
        right: place of another one.
        heavy: the one of them before which nodes stand that belong to the device.
        source: the vehicle from which these take their mass.
        times: closure over the stroke of the device.
        start: closure at which it engages [m].
    """

    left: int
    right: int
    heavy: int
    source: int
    times: float = 1.0
    start: float = 0.0

    def inside(self, node: int) -> _Between:
        """The same from a node on, which stands before the heavy one."""
        left, right = (self.left, node) if self.heavy == self.right else (node, self.right)
        return replace(self, left=left, right=right)


class _Assembly:
    """A deck as it is put together.

    Attributes:
        deck: so far.
        heaviest: largest mass of the nodes between springs, as a part of that of the vehicle that it was taken from.
    """

    def __init__(self, chain: Chain, title: str, slips: bool, step: float) -> None:
        """Make the deck for a step [s]."""
        self.deck = Deck(plain(title), step, chain.time_limit, chain.record_interval)
        self.heaviest = 0.0
        self._chain, self._slips = chain, slips
        walled = chain.interfaces[-1].right == WALL
        common = 0.0 if walled else float(np.average(chain.speed, weights=chain.mass))
        self._energy = float(0.5 * (chain.mass * (chain.speed - common) ** 2).sum())
        self._fastest = 2.0 * chain.closing_speed + 1.0
        self._vehicles()
        for interface in chain.interfaces:
            self._interface(interface)
        self._bodies()

    # nodes

    def _vehicles(self) -> None:
        """The masses of the vehicles, with rail friction, brakes and grade; the wall and the ground."""
        chain, deck = self._chain, self.deck
        at, places = 0.0, []
        for i, vehicle in enumerate(chain.vehicles):
            if i:
                at += max(_APART, 0.5 * (chain.vehicles[i - 1].length + vehicle.length))
            places.append(at)
        for point, mass, speed in zip(chain.points, chain.point_mass, chain.point_speed, strict=True):
            vehicle = chain.vehicles[point.vehicle]
            x = places[point.vehicle] + point.place - 0.5 * vehicle.length
            deck.nodes.append(Node(point.name, vehicle.name, x, float(mass), float(speed)))
        self._wall = self._fixed("wall", places[-1] + _APART) if chain.interfaces[-1].right == WALL else WALL
        friction = chain.friction
        ground = self._fixed("ground", places[0] - _GROUND)
        for k, point in enumerate(chain.points):
            brake = chain.vehicles[point.vehicle].brake
            limit = float(friction[k])
            if brake is not None and point.carried:
                limit += self._brake(k, point.carried)
            if limit > 0.0:
                deck.springs.append(Friction(f"rail {point.name}", k, ground, limit / _SLIP, limit))
                deck.kinds.add("friction")
            if grade := float(chain.grade_force[k]):
                ends = np.array([0.0, 2.0 * deck.end])
                deck.loads.append(Load(f"grade {point.name}", k, Curve(ends, np.full(2, grade))))
                deck.kinds.add("grade")

    def _brake(self, k: int, carried: float) -> float:
        """What a brake adds to the friction of a point [N]; what is missing at first is a load along the motion."""
        vehicle = self._chain.vehicles[self._chain.points[k].vehicle]
        brake = vehicle.brake
        assert brake is not None
        most = min(brake.force, brake.most) * carried
        self.deck.kinds.add("brake")
        if brake.delay == 0.0 and brake.rise == 0.0:
            return most
        whole = brake.delay + brake.rise * min(1.0, brake.most / brake.force)
        times = [0.0, brake.delay, whole, 2.0 * (self.deck.end + whole)]
        missing = math.copysign(most, vehicle.speed)
        pairs = dict(zip(times, [missing, missing, 0.0, 0.0], strict=True))  # of two at one time the last
        x, y = np.array(list(pairs)), np.array(list(pairs.values()))
        self.deck.loads.append(Load(f"brake {vehicle.name} not yet applied", k, Curve(*_rising(x, y))))
        return most

    def _fixed(self, name: str, x: float) -> int:
        self.deck.nodes.append(Node(name, "", x, _HEAVY))
        return len(self.deck.nodes) - 1

    def _small(self, name: str, near: int, x: float, stiffness: float, damping: float = 0.0) -> int:
        """A node between springs, heavy enough for the step, whose mass is taken from another one.

        Args:
            name: in words.
            near: the one that it is taken from.
            x: where it is drawn [m].
            stiffness: of all springs at it together [N/m].
            damping: of all dashpots at it together [N s/m].
        """
        step, nodes = self.deck.step, self.deck.nodes
        mass = stiffness * step**2 / _SWUNG + damping * step / _DAMPED
        from_ = nodes[near]
        self.heaviest = max(self.heaviest, mass / from_.mass)
        nodes[near] = replace(from_, mass=from_.mass - mass)
        nodes.append(Node(name, from_.vehicle, x, mass, from_.speed))
        return len(nodes) - 1

    def _before(self, name: str, at: _Between, stiffness: float, damping: float = 0.0) -> int:
        """A small node before the heavy one of two."""
        x = self.deck.nodes[at.heavy].x + (_NEAR if at.heavy == at.left else -_NEAR)
        return self._small(name, at.source, x, stiffness, damping)

    # interfaces

    def _interface(self, interface: Interface) -> None:
        left, right = self._chain.ends(interface)
        right = self._wall if right == WALL else right
        gap = self._chain.gap if interface is self._chain.interfaces[self._chain.front] else 0.0
        pushing = [element for element in interface.elements if element.sign > 0.0]
        for element in interface.elements:
            pulls = element.sign < 0.0
            which = " draw gear" if pulls else f" path {pushing.index(element) + 1}" if len(pushing) > 1 else ""
            name = interface.name + which
            start = element.start + (0.0 if pulls else gap)
            heavy = left if right == self._wall else right
            devices = " and ".join(dict.fromkeys(device.name for device in interface.devices))
            self.deck.sides.append(plain(f"{name}: {devices}, {_said(element)}"))
            if len(element.laws) == 1:
                at = _Between(left, right, heavy, heavy, 1.0 / element.share, start)
                self._device(name, at, element.laws[0], element)
                continue
            nodes = self.deck.nodes
            stiffness, damping = np.sum([self._far(law) for law in element.laws], axis=0)
            middle = self._small(
                f"{name} between", heavy, 0.5 * (nodes[left].x + nodes[right].x), float(stiffness), float(damping)
            )
            one = _Between(left, middle, left, left, 1.0, start)
            other = _Between(middle, right, right if heavy == right else middle, heavy)
            self._device(f"{name} left", one, element.laws[0], element)
            self._device(f"{name} right", other, element.laws[1], replace(element, breaks=math.inf))
            self.deck.kinds.add("series")

    def _far(self, law: Law) -> tuple[float, float]:
        """Stiffness and damping that a device has at the node which does not go with it [N/m, N s/m]."""
        k, _ = law.kind.bounds(law, 0.0)
        if law.kind.name == "hydraulic":
            return _CONTACT * k, 0.0
        if law.kind.name == "hysteresis" and not self._slips:
            return 2.0 * k, float(law.curves[0][1].max()) / _TURN
        if law.loading.damping:
            return _STIFF * k, self._rate_damping(law) if law.kind.name == "rate" else 0.0
        return (_RIGID if law.kind.name == "rate" else 1.0) * k, 0.0

    def _device(self, name: str, at: _Between, law: Law, element: Element) -> None:
        """A device by its law."""
        if element.sign < 0.0:
            if law.loading.damping:
                raise InputError(
                    f"{name}: a draw gear with a dashpot cannot be exported, as it acts only where the draw gear is "
                    "relieved, which no spring of a deck does: --set damping_kN_s_per_m of the pull to 0"
                )
            self._crush(name, at, law, pulls=True, breaks=element.breaks)
            self.deck.kinds.add("pull")
            return
        self.deck.kinds.add(law.kind.name)
        if math.isfinite(law.end):
            self.deck.kinds.add("end")
        made = {
            "crush": self._crush,
            "rate": self._rate,
            "hysteresis": self._hysteresis,
            "hydraulic": self._hydraulic,
        }[law.kind.name]
        made(name, at, law)

    def _crush(self, name: str, at: _Between, law: Law, pulls: bool = False, breaks: float = math.inf) -> None:
        """One spring; with a dashpot a slider, and spring and dashpot behind it."""
        envelope = law.loading
        if envelope.damping == 0.0 or not envelope.force.any():
            curve = self._curve(envelope, at, breaks=breaks)
            self.deck.springs.append(Crush(name, at.left, at.right, curve, envelope.stiffness / at.times, pulls))
            return
        self.deck.kinds.add("dashpot")
        node, slider, spring = self._sprung(name, at, envelope)
        inner = at.inside(node)
        curve = self._curve(envelope, at, spring)
        self.deck.springs.append(Crush(name, inner.left, inner.right, curve, slider))

    def _sprung(self, name: str, at: _Between, envelope: Envelope, extra: float = 0.0) -> tuple[int, float, float]:
        """Spring and dashpot of a device, behind a rigid slider and before its heavy node.

        They are one spring whose force is multiplied by 1 + c v / F, at least by 0, with the mean force F of the curve:
        a dashpot of its own would carry a part of the force while the curve rises, and hold the device back from
        following a stroke that lets it go.

        Args:
            name: of the device.
            at: where it acts.
            envelope: of the device.
            extra: what else damps the node between slider and spring, of the device [N s/m].

        Returns:
            The node between them; the stiffness of the slider and of the spring, both of the closure [N/m].
        """
        k, c = envelope.stiffness / at.times, envelope.damping / at.times
        slider, spring = _STIFF * k, _STIFF * k / (_STIFF - 1.0)
        path = envelope.climbing
        scale = path.energy(float(path.stroke[-1])) / float(path.stroke[-1]) / c  # at which it carries F [m/s]
        node = self._before(f"{name} inner", at, slider + spring, c + extra / at.times)
        ends = (node, at.right) if at.heavy == at.right else (at.left, node)
        x, y = np.array([-1.0, 0.0, 1.0]), spring * np.array([0.0, 0.0, 1.0])
        v = np.array([-2.0 * scale, -scale, at.times * self._fastest])
        factor = np.array([0.0, 0.0, 1.0 + v[-1] / scale])
        self.deck.springs.append(Elastic(f"{name} elastic", *ends, Curve(x, y), Curve(v, factor)))
        return node, slider, spring

    def _curve(self, envelope: Envelope, at: _Between, spring: float = math.inf, breaks: float = math.inf) -> Curve:
        """First loading over the closure, without what a spring [N/m] in series takes, up to a force [N]."""
        path = envelope.climbing
        u, f = _to_the_end(path, self._energy)
        if f.max() > breaks:
            u, f = _broken(u, f, breaks)
        x = at.start + at.times * u - f / spring
        if x[0] > 0.0:
            x, f = np.append(0.0, x), np.append(0.0, f)
        return Curve(*_rising(x, f))

    def _rate(self, name: str, at: _Between, law: Law) -> None:
        """The curve at rest and what the rate adds, side by side, behind a contact that lets go; then the dashpot."""
        envelope, path, (_, damping, _, _, until, *_) = law.loading, law.loading.climbing, law.parameters
        more = list(_faster(law, self._fastest))
        steepest = self._rate_damping(law)
        stiffness = envelope.stiffness
        if damping:
            self.deck.kinds.add("dashpot")
            node, slider, spring = self._sprung(name, at, envelope, steepest)
            inner = at.inside(node)
            sides = inner.left, inner.right
        else:
            spring = _RIGID * stiffness / at.times
            slider = stiffness / at.times / (1.0 - 1.0 / _RIGID)
            node = self._before(f"{name} inner", at, spring + slider, steepest / at.times)
            sides = (node, at.right) if at.heavy == at.right else (at.left, node)
            self._contact(name, at.inside(node), 0.0, spring)
        self.deck.springs.append(Crush(name, *sides, self._curve(envelope, at, spring), slider))
        for n, (u, f, factor) in enumerate(more, start=1):
            own = u <= until * (1.0 + 1e-12)
            x = at.start + at.times * u[own] - np.interp(u[own], path.stroke, path.force) / spring
            x = np.concatenate([[-1.0, x[0]], x, x[-1] + np.array([1e-4, 1.0])])
            curve = Curve(*_rising(x, np.concatenate([[0.0, 0.0], f[own], [0.0, 0.0]])))
            self.deck.springs.append(Elastic(f"{name} rate {n}", *sides, curve, Curve(at.times * factor.x, factor.y)))

    def _rate_damping(self, law: Law) -> float:
        """How fast the force of a device rises with the rate, at most [N s/m]."""
        return sum(float(np.abs(f).max()) * factor.steepest for _, f, factor in _faster(law, self._fastest))

    def _contact(self, name: str, at: _Between, start: float, stiffness: float) -> None:
        """A spring that pushes only, from a closure on, both of the closure."""
        curve = Curve(np.array([-1.0, start, start + 1.0]), stiffness * np.array([0.0, 0.0, 1.0]))
        self.deck.springs.append(Elastic(f"{name} contact", at.left, at.right, curve))

    def _stop(self, name: str, at: _Between, travel: float, stiffness: float) -> None:
        """The stop behind a stroke of the device [m]."""
        if stiffness > 0.0:
            self._contact(f"{name} stop", at, at.start + at.times * travel, stiffness / at.times)

    def _behind(self, name: str, at: _Between, collapse: float, stiffness: float, damping: float = 0.0) -> _Between:
        """Where a device acts, of a stiffness and damping, behind which a car body gives way at a force."""
        if math.isinf(collapse):
            return at
        rigid = _RIGID * stiffness
        node = self._before(f"{name} body", at, rigid + stiffness, damping)
        x = np.array([0.0, collapse / rigid, collapse / rigid + 1.0])
        ends = (node, at.right) if at.heavy == at.right else (at.left, node)
        self.deck.springs.append(
            Crush(f"{name} car body", *ends, Curve(x, collapse * np.array([0.0, 1.0, 1.0])), rigid)
        )
        return replace(at.inside(node), heavy=node)

    def _hysteresis(self, name: str, at: _Between, law: Law) -> None:
        """Two curves, a stop beside them, and the car body behind."""
        transition, travel, stop, most, *_ = law.parameters
        held = float(np.interp(travel, law.curves[0][0], law.curves[0][1])) if math.isfinite(travel) else 0.0
        at = self._behind(name, at, most + held, max(transition, stop) / at.times)
        soft = math.inf if self._slips else transition
        loading, unloading = (self._slipping(curve, at, travel, soft) for curve in law.curves)
        if math.isfinite(travel):  # behind its travel it stands, and nothing unloads
            end = float(loading.x[-2])
            before = unloading.x < end
            x = np.concatenate([unloading.x[before], [end, end + _STANDS, end + 1.0]])
            y = np.concatenate([unloading.y[before], [np.interp(end, unloading.x, unloading.y), held, held]])
            unloading = Curve(*_rising(x, y))
        if self._slips:
            self.deck.springs.append(Hysteresis(name, at.left, at.right, loading, unloading, transition / at.times))
        else:
            x = np.unique(np.concatenate([loading.x, unloading.x]))
            upper, lower = (np.interp(x, curve.x, curve.y) for curve in (loading, unloading))
            half = 0.5 * (upper - lower)
            stiffness = transition / at.times
            node = self._before(f"{name} inner", at, 2.0 * stiffness, float(half.max()) / _TURN)
            inner = at.inside(node)
            ends = (node, at.right) if at.heavy == at.right else (at.left, node)
            turn = Curve(_TURN * np.array([-2.0, -1.0, 1.0, 2.0]), np.array([-1.0, -1.0, 1.0, 1.0]))
            mean, sides = Curve(x, 0.5 * (upper + lower)), (inner.left, inner.right)
            self.deck.springs.append(Linear(f"{name} transition", *ends, stiffness))
            self.deck.springs.append(Elastic(f"{name} mean", *sides, mean))
            self.deck.springs.append(Elastic(f"{name} difference", *sides, Curve(x, half), turn))
        self._stop(name, at, travel, stop)

    def _slipping(self, curve: Array, at: _Between, travel: float, soft: float) -> Curve:
        """A curve up to a stroke [m] over the closure, without what a spring of the device [N/m] in series takes."""
        u, f, _ = curve
        inside = u <= travel * (1.0 + 1e-12)
        x = at.start + at.times * (u[inside] - f[inside] / soft)
        forces = np.concatenate([[0.0], f[inside], f[inside][-1:]])
        return Curve(*_rising(np.concatenate([[-1.0], x, [x[-1] + 1.0]]), forces))

    def _hydraulic(self, name: str, at: _Between, law: Law) -> None:
        """A plunger: contact before it; gas, preload and orifices behind it; a stop beside both."""
        travel, stop, most, preload, per_length, gamma, ramp, rebound, knee, empty = law.parameters
        d = np.unique(np.concatenate([[0.0, knee, travel], np.linspace(knee, travel, 60)]))
        spring = np.where(d <= knee, ramp * d, preload * (1.0 - per_length * np.minimum(d, travel)) ** -gamma)
        t, fastest = at.times, self._fastest
        orifice = law.curves[0]
        gives_back = math.isfinite(rebound)
        strongest = max(float(orifice[1].max()), rebound if gives_back else 0.0)
        contact = _CONTACT * _hardest(law) / t
        damping = 2.0 * strongest * fastest / t + (0.0 if gives_back else preload / _PRESSED / t)
        at = self._behind(name, at, most + float(spring[-1]), contact, damping)
        node = self._before(f"{name} plunger", at, 2.0 * contact, damping)
        inner = at.inside(node)
        ends = (node, at.right) if at.heavy == at.right else (at.left, node)
        self._contact(name, inner, at.start + t * empty, contact)
        v = np.linspace(0.0, fastest, 200)
        closing = Curve(np.append(-1.0, t * v), np.append(0.0, (v / fastest) ** 2))
        opening = Curve(np.append(-t * v[::-1], 1.0), np.append(-((v[::-1] / fastest) ** 2), 0.0))
        x, c = orifice[0] - empty, orifice[1]
        inside = (x >= 0.0) & (x < travel * (1.0 - 1e-12))
        x, c = (
            np.append(x[inside], travel),
            np.append(c[inside], float(np.interp(travel, orifice[0] - empty, orifice[1]))),
        )
        forces = c * fastest**2
        ends_x = t * travel + np.array([1e-5, 1.0])
        over = Curve(
            *_rising(np.concatenate([[-1.0, 0.0], t * x, ends_x]), np.concatenate([[0.0, 0.0], forces, [0.0, 0.0]]))
        )
        self.deck.springs.append(Elastic(f"{name} orifice", *ends, over, closing))
        if preload:
            gas = Curve(
                *_rising(
                    np.concatenate([[-1.0], t * d, [t * travel + 1.0]]), np.concatenate([[0.0], spring, spring[-1:]])
                )
            )
            pressed = Curve(np.array([-1.0, 0.0, _PRESSED * t, 1.0 + t]), np.array([0.0, 0.0, 1.0, 1.0]))
            self.deck.springs.append(Elastic(f"{name} gas", *ends, gas, None if gives_back else pressed))
        if gives_back and rebound > 0.0:
            back = Curve(np.array([-1.0, 0.0, 1e-5, 1.0]), rebound * fastest**2 * np.array([0.0, 0.0, 1.0, 1.0]))
            self.deck.springs.append(Elastic(f"{name} rebound", *ends, back, opening))
        if not gives_back:
            self.deck.springs.append(Friction(f"{name} held", *ends, _HELD / _SLIP, _HELD))
        self._stop(name, at, empty + travel, stop)

    # bodies

    def _bodies(self) -> None:
        """The members of bodies that give."""
        for member in self._chain.members:
            self.deck.kinds.add("body")
            k, c, h = member.stiffness, member.damping, member.hardening
            at = _Between(member.left, member.right, member.right, member.right)
            if math.isinf(member.collapse):
                self.deck.springs.append(Linear(member.name, at.left, at.right, k, c))
            elif c == 0.0:
                self.deck.springs.append(Friction(member.name, at.left, at.right, k, member.collapse, k * h / (k + h)))
            else:
                rigid = _RIGID * k
                node = self._before(f"{member.name} inner", at, rigid + k, c)
                self.deck.springs.append(Linear(f"{member.name} elastic", node, at.right, k * rigid / (rigid - k), c))
                tangent = rigid * h / (rigid + h)
                self.deck.springs.append(Friction(member.name, at.left, node, rigid, member.collapse, tangent))


def _hardest(law: Law) -> float:
    """The stiffest that a device is [N/m]."""
    return law.kind.bounds(law, 0.0)[0]


def _faster(law: Law, fastest: float) -> Iterator[tuple[Array, Array, Curve]]:
    """What a rate adds to a device: strokes [m], forces [N], and a curve by which these are multiplied over the rate.

    Args:
        law: of the device.
        fastest: rate up to which it is wanted [m/s].
    """
    path, (_, _, reference, exponent, *_) = law.loading.climbing, law.parameters
    if not law.speeds:
        v = np.append(0.0, np.geomspace(LINEAR, max(fastest, 2.0 * LINEAR), _RATE_POINTS))
        x = np.concatenate([[-1.0, -LINEAR], v])
        yield path.stroke, path.force, Curve(x, np.concatenate([[-_BACK, -_BACK], (v / reference) ** exponent]))
        return
    slow, below = 0.0, law.curves[0]
    for speed, curve in zip(law.speeds, law.curves[1:], strict=True):
        u = np.unique(np.concatenate([below[0], curve[0], path.stroke]))
        here, before = (np.interp(u, c[0], c[1]) for c in (curve, below))
        x, y = np.array([slow - 1.0, slow, speed, speed + 1.0]), np.array([0.0, 0.0, 1.0, 1.0])
        if not slow:
            x, y = np.concatenate([[-1.0, -LINEAR], x[1:]]), np.concatenate([[-_BACK, -_BACK], y[1:]])
        yield u, here - before, Curve(x, y)
        slow, below = speed, curve


def _said(element: Element) -> str:
    """What an element is, in words."""
    said = " on ".join(dict.fromkeys(law.kind.name for law in element.laws))
    if len(element.laws) == 2:
        said += ", left in series with right"
    elif element.share < 1.0:
        said += ", one spring for two equal ones in series"
    ends = dict.fromkeys(f"{law.end / MM:.6g} mm" for law in element.laws if math.isfinite(law.end))
    return f"{said}, not valid behind a device stroke of {' or '.join(ends)}" if ends else said


def _to_the_end(path: Envelope, energy: float) -> tuple[Array, Array]:
    """Strokes [m] and forces [N] of a curve to where it has taken an energy [J], at least 0.1 m behind its end."""
    force, slope = float(path.force[-1]), path.last_slope
    more = (math.sqrt(force**2 + 2.0 * slope * energy) - force) / slope if slope else energy / force if force else 0.0
    more = max(more, 0.1)
    return np.append(path.stroke, path.stroke[-1] + more), np.append(path.force, force + slope * more)


def _broken(u: Array, f: Array, most: float) -> tuple[Array, Array]:
    """A curve that ends where it first reaches a force."""
    k = int(np.argmax(f >= most))
    at = float(np.interp(most, f[k - 1 : k + 1], u[k - 1 : k + 1]))
    return np.concatenate([u[:k], [at, at + 1e-6, at + 1.0]]), np.concatenate([f[:k], [most, 0.0, 0.0]])


def _rising(x: Sequence[float] | Array, y: Sequence[float] | Array) -> tuple[Array, Array]:
    """A curve whose points are a least width apart; where many are at one place, the first and the last count."""
    kept_x, kept_y = [float(x[0])], [float(y[0])]
    for k in range(1, len(x)):
        if k + 1 < len(x) and x[k] - kept_x[-1] < _WIDTH and x[k + 1] - kept_x[-1] < _WIDTH:
            continue
        if x[k] - kept_x[-1] < _WIDTH and y[k] == kept_y[-1]:
            continue
        kept_x.append(max(float(x[k]), kept_x[-1] + _WIDTH))
        kept_y.append(float(y[k]))
    return np.array(kept_x), np.array(kept_y)
