"""What others have printed: the tables of the paper behind the B-type train, and the trend of Shao et al. 2016."""

from __future__ import annotations

from collections.abc import Iterator

from trainmj.paper.bars import MISSED
from trainmj.paper.collisions import all_cases, simulate
from trainmj.paper.tables import OURS, compare_collisions
from trainmj.paper.verdicts import verdicts_of_collisions
from trainmj.verification.check import Check, at_least, zero
from trainmj.verification.systems import collide, shipped

NOT_CHECKED = (
    "Bars of the paper that the shipped curves miss on every machine; trainmj paper shows by how much: "
    f"{'; '.join(sorted(MISSED))}.",
    "Shao et al. 2016 compare the two main absorbers at the front: 11.69 % more on one side at 10 km/h, 3.60 % at 36. "
    "Here two equal sets act as one and deform alike by construction. With a vehicle of 1 t before each, the split of "
    "two equal plateaus hangs on how the two meet, and changes its sign with the speed (benchmarks/shao.py). What is "
    "checked is the same effect behind the head cars: rail friction makes the moving train's couplers deform more than "
    "the standing one's, less so at 36 than at 10 km/h, and not at all without friction.",
    "MIRA 2009, a coach of 32 t into a locomotive: the 1.5 MJ that are printed are the coach's kinetic energy, "
    "1.548 MJ, and no crush is printed. That 1.113 MJ of it are lost is a formula, and checked as one.",
    "FRA test of two conventional trains, 31 January 2002: the cab car climbed, which one dimension has not; "
    "fra_conventional_train is 37 to 43 % short of the crush.",
    "Li 2020 prints strokes and forces of a six-car metro, but not its devices: nothing can be computed.",
    "The clauses of EN 15227 are not checked.",
)
"""What the suite does not say, and why."""


def paper() -> Iterator[Check]:
    """Liu et al. 2022, doi 10.1186/s10033-022-00755-8: its collisions, every bar that the shipped curves meet."""
    for v in verdicts_of_collisions(compare_collisions({OURS: simulate(all_cases())})):
        if v.bar is not None and v.item not in MISSED:
            yield zero(f"Paper: {v.group}", v.item, v.deviation, v.bar, v.unit)


def shao() -> Iterator[Check]:
    """The trend of Shao et al. 2016, doi 10.1155/2016/3084052, behind the head cars."""
    name = "Eight-car train, couplers of both trains"
    slow, fast, free = (_asymmetry(speed, friction) for speed, friction in ((10.0, 0.008), (36.0, 0.008), (10.0, 0.0)))
    yield at_least(name, "moving more than standing at 10 km/h", 0.1, slow, "%")
    yield at_least(name, "moving more than standing at 36 km/h", 0.1, fast, "%")
    yield at_least(name, "less at 36 than at 10 km/h, by", 0.1, slow - fast, "%")
    yield zero(name, "without rail friction", free, 1e-6, "%")


def _asymmetry(speed_km_h: float, friction: float) -> float:
    """How much more the moving train's couplers deform than the standing one's, over their mean [%]."""
    (summary,) = collide(shipped("en15227_c1", {"speed_km_h": speed_km_h, "collision.rail_friction": friction}))
    _, *couplers = summary.interfaces
    moving, standing = (sum(i.stroke_mm for i in couplers if i.name[0] == side) for side in "MS")
    return 200 * (moving - standing) / (moving + standing)


CASES = (paper, shao)
