"""The pages that are made from the software itself: commands, files, responses, Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import api
import commands
import fields
import responses
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

PAGES: dict[str, Callable[[], str]] = {
    "reference/commands.md": commands.page,
    "reference/scenario-file.md": fields.scenario_page,
    "reference/sweep-file.md": fields.sweep_page,
    "reference/study-file.md": fields.study_page,
    "reference/targets-file.md": fields.targets_page,
    "reference/assessment-file.md": fields.assessment_page,
    "reference/partner-file.md": fields.partner_page,
    "reference/reliability-file.md": fields.reliability_page,
    "reference/responses.md": responses.page,
    "reference/python.md": api.page,
    "reference/python-study.md": api.study_page,
}


def on_files(files: Files, config: MkDocsConfig, **_: Any) -> Files:
    """Add these pages to the site."""
    for name, make in PAGES.items():
        files.append(File.generated(config, name, content=make()))
    return files
