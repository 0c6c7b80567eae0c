"""The folder of an assessment: its numbers as JSON and CSV, the scenario of each case, and the page."""

from __future__ import annotations

import json
from pathlib import Path

from trainmj.assessment.found import Assessment
from trainmj.assessment.page import page_of
from trainmj.files.cover import Cover
from trainmj.files.folder import staged
from trainmj.files.written import finite
from trainmj.output.page import REPORT
from trainmj.scenario import to_yaml

FILE = "assessment.json"
OWN = r"assessment\.(json|csv)|case_\d+\.yaml|report\.html"
"""The files of the folder, as a pattern of their names."""


def write_assessment(assessment: Assessment, folder: Path, command: str, cover: Cover | None = None) -> None:
    """Write assessment.json, assessment.csv, case_1.yaml and so on, and the page if it has a cover; all or none.

    Raises:
        OutputError: if a file cannot be written.
    """
    with staged(folder, OWN, FILE) as stage:
        assessment.to_frame().to_csv(stage / "assessment.csv", index=False)
        for n, outcome in enumerate(assessment.outcomes, start=1):
            if outcome.case.scenario is not None:
                (stage / f"case_{n}.yaml").write_text(to_yaml(outcome.case.scenario), encoding="utf-8")
        if cover is not None:
            page_of(assessment, command).headed(cover).write(stage / REPORT)
        (stage / FILE).write_text(json.dumps(finite(assessment.as_dict()), indent=2), encoding="utf-8")
