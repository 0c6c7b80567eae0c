"""Every status that a collision may end with has words and looks in the reports."""

from __future__ import annotations

import pytest

import trainmj
from trainmj.collision.status import MEANING, Kind
from trainmj.scenario import load
from trainmj.single.tables import outcome
from trainmj.sweep.page_responses import LOOK


def test_each_status_has_a_look_of_its_own_and_a_meaning():
    assert set(LOOK) == set(MEANING) == set(Kind)
    assert len(set(LOOK.values())) == len(Kind)


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"collision.gap_mm": 5000, "simulation.time_limit_s": 0.1}, Kind.NO_CONTACT),
        ({"simulation.time_limit_s": 0.05}, Kind.TIME_LIMIT),
    ],
)
def test_the_verdict_of_a_run_that_is_not_over_warns(changes, kind):
    summary = trainmj.summarise(trainmj.run(load("b_type_wall", changes)))
    assert summary.status.kind == kind
    assert outcome(summary.status.kind).kind == "warn"
