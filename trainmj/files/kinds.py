"""The kinds of input file, told apart by their keys."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Kind(NamedTuple):
    """A kind of input file."""

    name: str
    ending: str  # of the names of shipped ones, and by custom of others
    takes: str  # what reads it: command and function
    own: frozenset[str]  # keys that tell it from other kinds, as no other one has them, or rarely


def _kind(name: str, ending: str, takes: str, own: str) -> Kind:
    return Kind(name, ending, takes, frozenset(own.split()))


SCENARIO, SWEEP, STUDY, TARGETS, PARTNER, ASSESSMENT, RELIABILITY = KINDS = (
    _kind(
        "scenario file",
        ".yaml",
        "trainmj run or trainmj.load",
        "builds_on changed plane ties bracket curves devices trains vehicle_types obstacles as_built collision "
        "occupants simulation report",
    ),
    _kind(
        "sweep file",
        ".sweep.yaml",
        "trainmj sweep or trainmj.load_sweep",
        "vary together cases table sample histories",
    ),
    _kind(
        "study file",
        ".study.yaml",
        "trainmj study or trainmj.load_study",
        "factors design correlation surrogates cross_validation objectives optimiser weights decision check quality "
        "robust",
    ),
    _kind(
        "targets file",
        ".targets.yaml",
        "trainmj identify or trainmj.load_targets",
        "targets data held_out method",
    ),
    _kind(
        "partner file",
        ".partner.yaml",
        "collision.partner of a scenario",
        "train obstacle curves devices vehicle_types",
    ),
    _kind(
        "assessment file",
        ".assessment.yaml",
        "trainmj assess or trainmj.load_assessment",
        "edition categories load_states brakes scenarios reported not_computed",
    ),
    _kind(
        "reliability file",
        ".reliability.yaml",
        "trainmj reliability or trainmj.load_reliability",
        "tolerances runs seed draws quantiles level rare sensitivity",
    ),
)


def kind_of(keys: Iterable[str]) -> Kind | None:
    """The kind of file that has most of some keys for its own; None if there is none, or no single one."""
    stated = set(keys)
    first, second = sorted(KINDS, key=lambda kind: len(kind.own & stated), reverse=True)[:2]
    return first if len(first.own & stated) > len(second.own & stated) else None
