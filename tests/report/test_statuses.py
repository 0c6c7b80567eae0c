"""Every status that a collision may end with has words and looks in the reports."""

from __future__ import annotations

import pytest

import trainmj
from trainmj.cases.table import REFUSED, responses_of
from trainmj.scenario import load
from trainmj.single.limits import outcome
from trainmj.sweep.page import _MEANING
from trainmj.sweep.page_responses import _LOOK

STATUSES = ("over", "time limit", "no contact", "stroke exhausted", "unstable", REFUSED)


def test_each_status_has_a_look_of_its_own_and_a_meaning():
    assert set(_LOOK) == set(_MEANING) == set(STATUSES)
    assert len(set(_LOOK.values())) == len(STATUSES)


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({"collision.gap_mm": 5000, "simulation.time_limit_s": 0.1}, "no contact"),
        ({"simulation.time_limit_s": 0.05}, "time limit"),
    ],
)
def test_the_verdict_of_a_run_that_is_not_over_warns(changes, status):
    summary = trainmj.summarise(trainmj.run(load("b_type_wall", changes)))
    assert responses_of(summary)["status"] == status
    assert outcome(summary.status).kind == "warn"
