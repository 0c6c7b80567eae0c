"""The page of an assessment: verdict, criteria, cases, what is not computed, and every number with its source."""

from __future__ import annotations

from trainmj.assessment import tables
from trainmj.assessment.found import Assessment
from trainmj.files.provenance import Provenance
from trainmj.output.blocks import Card
from trainmj.output.page import Page
from trainmj.output.sources import sources_table
from trainmj.output.table import judged
from trainmj.scenario import Scenario, to_yaml


def page_of(assessment: Assessment, command: str) -> Page:
    """The page of an assessment; the command makes it again."""
    spec = assessment.standard.spec
    subtitle = f"Train: that of {assessment.train.heading}. Edition: {spec.edition or 'not stated'}."
    page = Page(assessment.title, subtitle, command, assessment.versions)
    page.verdict, page.cover = tables.verdict(assessment), assessment.train.report
    section = page.section("Verdict")
    worst = assessment.judged
    kept = sum(row.criterion.kept for row in worst)
    least = max(worst, key=lambda row: row.rank, default=None)
    cards = [
        Card(
            "Criteria",
            f"{kept} of {len(worst)}",
            "kept",
            f"in {len(assessment.outcomes)} cases",
            judged(assessment.passed, "passed as far as computed", "not passed"),
        ),
        Card("Not computed", f"{len(assessment.not_computed)}", note="asked of the train, and not answered here"),
    ]
    if least is not None:
        c = least.criterion
        verdict = judged(c.kept, "kept", "limit passed")
        cards.append(Card("Least margin", tables.margin(least), "%", f"{c.title}, {c.where}".rstrip(", "), verdict))
    section.cards(*cards)
    section.notes(assessment.failed)
    section.text(*(paragraph for paragraph in (spec.notes.strip(), *assessment.remarks) if paragraph))
    page.section("Criteria").table(tables.criteria(assessment))
    section = page.section("Cases")
    section.table(tables.cases(assessment))
    section.text(
        "case_1.yaml and so on are their scenarios: trainmj run case_1.yaml --out case_1 --report has the same numbers."
    )
    of_cases = tables.remarks(assessment)
    if of_cases.rows:
        section.table(of_cases)
    page.section("Not computed").table(tables.not_computed(assessment))
    section = page.section("Numbers and sources")
    section.table(sources_table(spec.sources, assessment.standard.source.values, spec.title))
    for scenario, sources in _partners(assessment).values():
        section.table(sources_table(sources, scenario.values(), f"Partner {scenario.collision.partner}"))
    section = page.section("Train")
    if assessment.train.sources:
        section.table(sources_table(assessment.train.sources, assessment.train.values()))
    section.code(to_yaml(assessment.train), "scenario of the train")
    return page


def _partners(assessment: Assessment) -> dict[str, tuple[Scenario, dict[str, str | Provenance]]]:
    """A scenario into each partner, and what is said of where its values come from beside the train's own file."""
    found: dict[str, tuple[Scenario, dict[str, str | Provenance]]] = {}
    for outcome in assessment.outcomes:
        scenario = outcome.case.scenario
        if scenario is not None:
            own = {path: e for path, e in scenario.sources.items() if path not in assessment.train.sources}
            stated = {path: entry for path, entry in own.items() if not path.startswith("limits.")}
            found |= {scenario.collision.partner: (scenario, stated)} if stated else {}
    return found
