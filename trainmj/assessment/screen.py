"""What is printed of an assessment."""

from __future__ import annotations

from rich.text import Text

from trainmj.assessment import tables
from trainmj.assessment.found import Assessment
from trainmj.assessment.plan import Standard
from trainmj.output.console import new_console, print_table, print_verdict
from trainmj.output.sources import sources_table


def print_assessment(assessment: Assessment) -> None:
    """The verdict, the criteria, the cases and what is not computed."""
    console = new_console()
    spec = assessment.standard.spec
    console.print(Text(assessment.title, style="bold"))
    console.print(Text(f"Train: that of {assessment.train.heading}"))
    if spec.edition:
        console.print(Text(f"Edition: {spec.edition}"))
    print_verdict(console, tables.verdict(assessment))
    for sentence in assessment.failed:
        console.print(Text(f"- {sentence}"))
    for made in (tables.criteria, tables.cases, tables.remarks, tables.not_computed):
        table = made(assessment)
        if table.rows:
            console.print()
            print_table(console, table)
    console.print()
    for remark in filter(None, (*assessment.remarks, spec.notes.strip())):
        console.print(Text(f"Note: {remark}"))


def print_plan(standard: Standard) -> None:
    """What an assessment file asks."""
    console = new_console()
    spec = standard.spec
    console.print(Text(spec.title, style="bold"))
    if spec.edition:
        console.print(Text(spec.edition))
    for table in (tables.asked(standard), sources_table(spec.sources, standard.source.values)):
        console.print()
        print_table(console, table)
