"""The suite: every case, in order, and what was found."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from trainmj.collision.identity import identity
from trainmj.collision.mj import undisturbed
from trainmj.errors import TrainmjError
from trainmj.files.shown import Shown
from trainmj.output.table import Verdict, judged
from trainmj.verification import (
    bodies,
    closed_forms,
    exact,
    full_scale,
    numerics,
    oracles,
    plane,
    published,
    symmetries,
)
from trainmj.verification.check import Check

Case = Callable[[], Iterator[Check]]


@dataclass(frozen=True)
class Group:
    """Cases of one kind."""

    title: str  # what they are
    note: str  # why they count as evidence
    cases: tuple[Case, ...]  # functions that compute the checks of each


GROUPS = (
    Group("Closed forms", "Collisions whose outcome is a formula.", closed_forms.CASES),
    Group(
        "Kinds of devices, brakes, grades",
        "Collisions of each kind whose outcome is a formula or a root of one, computed at a fine step.",
        exact.CASES,
    ),
    Group(
        "Bodies that give",
        "Waves, frequencies, damping and collapse of bodies as formulas have them, and the largest stable step.",
        bodies.CASES,
    ),
    Group(
        "The vertical plane",
        "Rest, natural frequencies and what is conserved, as formulas have them; with all but the motion along the "
        "track held, the collisions along it; two equal trains that mirror each other; a batch and single runs; random "
        "trains beside scipy, in other coordinates.",
        plane.CASES,
    ),
    Group(
        "Computed by others",
        "MuJoCo's own elasto-plastic tendons; and scipy's integrators from one change of branch to the next, which "
        "share no code with the device law.",
        oracles.CASES,
    ),
    Group("Symmetries", "Collisions that must come out alike.", symmetries.CASES),
    Group(
        "Energy and momentum",
        "The absorbed energy is added up from the device law, so that the balance closes only if the motion is right.",
        closed_forms.BALANCES,
    ),
    Group("Step and batch", "What must not matter, and by how much it does.", numerics.CASES),
    Group(
        "Published numbers",
        "The collisions of the paper behind the B-type train, some of them held out when its devices were identified, "
        "and what others have printed.",
        published.CASES,
    ),
    Group(
        "Full-scale tests",
        "Measurement beside computation: the curve of the car ends was fitted to the tests against a wall, which says "
        "nothing; that of two trains was held out, and its tolerances are bars on a prediction. Then plastic "
        "collisions of tests and standards, whose loss is a formula.",
        full_scale.CASES,
    ),
)


@dataclass(frozen=True)
class Verification(Shown):
    """What the suite found."""

    groups: tuple[tuple[Group, tuple[Check, ...]], ...]  # each with its checks
    seconds: float  # of computing

    def __repr__(self) -> str:
        """The verdict."""
        return f"<Verification: {self.verdict.text}>"

    @property
    def verdict(self) -> Verdict:
        """How many checks are within their tolerance, in one sentence."""
        n, failed = len(self.checks), [f"{check.case}, {check.what}" for check in self.failed]
        kept = f"All {n} checks are within their tolerance." if n else "Nothing was checked."
        fail = "FAILS" if len(failed) == 1 else "FAIL"
        which = f"{'; '.join(failed[:3])}{f' and {len(failed) - 3} more' if failed[3:] else ''}"
        return judged(self.passed, kept, f"{len(failed)} of {n} checks {fail}: {which}." if failed else kept)

    @property
    def checks(self) -> list[Check]:
        """All of them."""
        return [check for _, checks in self.groups for check in checks]

    @property
    def failed(self) -> list[Check]:
        """Those that did not pass."""
        return [check for check in self.checks if not check.passed]

    @property
    def passed(self) -> bool:
        """Whether there were checks, and all passed."""
        return bool(self.checks) and not self.failed

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as ``trainmj verify --json`` prints them."""
        return {
            "passed": self.passed,
            "checks": len(self.checks),
            "failed": len(self.failed),
            "seconds": round(self.seconds, 1),
            "versions": identity(),
            "groups": [
                {"title": group.title, "checks": [check.as_dict() for check in checks]} for group, checks in self.groups
            ],
            "not_checked": list(published.NOT_CHECKED),
        }


@undisturbed()
def verify(tell: Callable[[str], object] = lambda _: None) -> Verification:
    """Compute every case.

    Args:
        tell: called with the title of each group before it is computed.
    """
    began = time.perf_counter()
    groups = []
    for group in GROUPS:
        tell(group.title)
        groups.append((group, tuple(check for case in group.cases for check in run_case(case))))
    return Verification(tuple(groups), time.perf_counter() - began)


def run_case(case: Case) -> Iterator[Check]:
    """The checks of a case; one that cannot be computed is a check that fails and says why."""
    try:
        yield from case()
    except TrainmjError as error:
        yield Check(case.__name__.replace("_", " "), f"could not be computed: {error}", 0.0, float("nan"), 0.0)
