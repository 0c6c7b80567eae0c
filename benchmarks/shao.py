"""The asymmetry of Shao et al. 2016 (doi 10.1155/2016/3084052): does the moving train's head device give more?

python benchmarks/shao.py

They print 11.69 % at 10 km/h and 3.60 % at 36, as (moving - standing) / (both) of the head devices. The train is
``en15227_c1``. As it ships, the two equal head devices meet and act as one. Here one of them may be stronger by a
hundred thousandth, or a vehicle of 1 t stands before each, as the end of a coupler that meets the other one: the split
of the two is then computed, and hangs on these small things.
"""

from __future__ import annotations

import copy
from typing import Any

import trainmj
from trainmj.collision.batch import run_chains
from trainmj.collision.lineup import line_up
from trainmj.scenario import Scenario

SPEEDS = (10.0, 16.0, 25.0, 36.0)  # km/h
FRICTIONS = (0.0, 0.008, 0.05)


def scenario(damping: float, mass_t: float = 1.0) -> Scenario:
    """The shipped train with a vehicle of so many t before each head device; they meet with a dashpot [kN s/m]."""
    values: dict[str, Any] = trainmj.load("en15227_c1").values()
    train = values["trains"]["main_line"]
    face = {"name": "face", "mass_t": mass_t, "length_m": 1, "coupler": "head"}
    train |= {"front": "contact", "vehicles": [face, *train["vehicles"]]}
    values["devices"]["contact"] = {
        "curve": {"stroke_mm": [0, 20], "force_kN": [0, 20_000]},
        "stiffness_kN_per_mm": 1000,
        "damping_kN_s_per_m": damping,
        "beyond": "hold",
    }
    return Scenario.from_values(values)


def directly(factor: float) -> Scenario:
    """The head devices meet, the standing train's force this factor times the moving one's: equal ones act as one."""
    values: dict[str, Any] = trainmj.load("en15227_c1").values()
    head = copy.deepcopy(values["devices"]["head"])
    for stage in head["stages"].values():
        stage["curve"]["force_kN"] = [factor * force for force in stage["curve"]["force_kN"]]
    values["devices"]["standing_head"] = head
    values["trains"]["standing"] = values["trains"]["main_line"] | {"front": "standing_head"}
    values["collision"]["partner"] = "standing"
    return Scenario.from_values(values)


def asymmetries(of: Scenario, friction: float, step_ms: float = 0.01) -> list[float]:
    """(moving - standing) / (both) of the head devices' largest strokes [%] at each of the speeds."""
    fixed = {"collision.rail_friction": friction, "simulation.step_ms": step_ms}
    chains = [line_up(of.with_values({"speed_km_h": speed, **fixed})) for speed in SPEEDS]
    found = dict(run_chains(enumerate(chains)))
    sides = ("M1-M2", "S1-S2") if "contact" in of.devices else ("S1-M1", "S1-M1 partner")
    strokes = [{i.name: i.stroke_mm for i in found[k].interfaces} for k in range(len(SPEEDS))]
    pairs = [[of_interface[side] for side in sides] for of_interface in strokes]
    return [100 * (moving - standing) / (moving + standing) for moving, standing in pairs]


def main() -> None:
    """Print the table."""
    print(f"{'':44}" + "".join(f"{speed:>6g} km/h" for speed in SPEEDS))
    print(f"{'published':44}{11.69:11.2f}{'':22}{3.60:11.2f}")
    variants = [(f"devices meet, standing one x {f:g}", directly(f), 0.01) for f in (0.99999, 1.00001)]
    for damping in (0, 100, 1000):
        variants.append((f"1 t faces, contact of {damping} kN s/m", scenario(damping), 0.01))
    variants.append(("the same at a step of 0.1 ms", scenario(1000), 0.1))
    variants.append(("5 t faces, contact of 1000 kN s/m", scenario(1000, 5.0), 0.01))
    for words, of, step in variants:
        for friction in FRICTIONS:
            found = asymmetries(of, friction, step)
            print(f"{words + f', mu {friction:g}':44}" + "".join(f"{value:11.2f}" for value in found))


if __name__ == "__main__":
    main()
