"""What a study found, as ``summary.json`` has it: what was asked in full, and the facts of all steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from trainmj.collision.identity import identity
from trainmj.files.written import finite
from trainmj.scenario import to_yaml
from trainmj.study.folder import Step
from trainmj.study.plan import Study
from trainmj.study.remarks import Remark, of_result

if TYPE_CHECKING:
    import pandas as pd


def summary_of(
    study: Study,
    done: Sequence[Step[Any]],
    robust: tuple[Study, Sequence[Step[Any]]] | None,
    failed: str,
    changes: Sequence[str],
) -> dict[str, Any]:
    """The summary of a study; null where JSON has no number.

    Args:
        study: what was asked.
        done: its steps.
        robust: the study of the statistics, and its steps, if robust designs were found.
        failed: why none were; empty if they were, or were not asked for.
        changes: what had changed since the last run, in words.
    """
    about = {
        "title": study.title,
        **_again(study),
        "versions": identity(),
        "changes": list(changes),
    }
    found = about | _found(study, done)
    if failed:
        found["remarks"] = [asdict(Remark("fail", "robust designs", failed)), *found["remarks"]]
        found["trusted"] = False
    if robust is not None:
        found["robust"] = _found(*robust)
        found["trusted"] = found["trusted"] and found["robust"]["trusted"]
    result: dict[str, Any] = finite(found)
    return result


def tables_of(done: Sequence[Step[Any]]) -> dict[str, pd.DataFrame]:
    """The tables of steps, by file name without ending."""
    return {name: table for step in done for name, table in step.tables.items()}


def _found(study: Study, done: Sequence[Step[Any]]) -> dict[str, Any]:
    """What was asked of the responses, the facts of each step by its name, and what is to be said of them."""
    facts: Mapping[str, Any] = {step.name.replace(" ", "_"): dict(step.facts) for step in done}
    remarks = of_result(study, facts, tables_of(done))
    return {
        "factors": {f.name: {"unit": f.unit, "lower": f.lower, "upper": f.upper} for f in study.space.factors},
        "responses": {r.name: {"unit": r.unit, "column": r.column} for r in (*study.responses, *study.worst_of_cases)},
        "objectives": dict(study.spec.objectives),
        "constraints": [limit.text for limit in study.limits],
        "cases": {name: scenario.subject for name, scenario in study.scenarios.items() if name},
        **facts,
        "trusted": all(remark.kind != "fail" for remark in remarks),
        "remarks": [asdict(remark) for remark in remarks],
    }


def _again(study: Study) -> dict[str, Any]:
    """The study as it was read, its scenario, and those that load cases name, as files beside each other."""
    again = dict(study.source.values, scenario="scenario.yaml")
    others = {f"{name}.yaml": name for name, case in (study.spec.cases or {}).items() if case.scenario is not None}
    for file, name in others.items():
        again["cases"] = again["cases"] | {name: again["cases"][name] | {"scenario": file}}
    scenarios = {file: to_yaml(study.scenarios[name]) for file, name in others.items()}
    return {"study": again, "scenario": to_yaml(study.scenario), "scenarios": scenarios}
