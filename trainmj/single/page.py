"""The report of one collision."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from shlex import quote

from trainmj.collision.chain import Chain
from trainmj.collision.quantities import TRAIN
from trainmj.collision.result import Result
from trainmj.collision.saved import load_result
from trainmj.collision.status import MEANING
from trainmj.collision.summary import Summary, summarise
from trainmj.collision.verdict import verdict
from trainmj.errors import InputError
from trainmj.output.blocks import Card, Section
from trainmj.output.page import Page
from trainmj.output.sources import sources_table
from trainmj.output.table import Table, failed, judged
from trainmj.scenario import to_yaml
from trainmj.scenario.trains import RIGID_WALL
from trainmj.single import tables, tables_plane
from trainmj.single.beside import Beside, beside_of
from trainmj.single.page_animation import add_animation
from trainmj.single.page_bodies import add_bodies
from trainmj.single.page_devices import add_devices
from trainmj.single.page_histories import add_histories, add_occupants
from trainmj.single.page_plane import add_plane
from trainmj.single.used import add_used
from trainmj.units import readable

ANIMATED = "The collision"
"""The title of the section that holds the animation."""

_OF_PLANE = ("largest_step", "largest_wheel_lift", "least_wheel_load")  # criteria that are cards there
_MOST_ROWS = 24  # of a table of details; a longer one is folded away


def page_of_file(file: Path) -> Page:
    """The report of a saved result, which holds its scenario too.

    Raises:
        InputError: if the file cannot be read.
    """
    result = load_result(file)
    summary = summarise(result)
    return page_of_run(result, summary, file, beside_of(file, result, summary))


def page_of_run(result: Result, summary: Summary, file: Path | None = None, beside: Beside | None = None) -> Page:
    """The report of one collision.

    Args:
        result: of the collision.
        summary: of the result.
        file: in which it is or will be, for the commands that make it again; None if it is in memory only.
        beside: what was computed beside it.

    Raises:
        InputError: if nothing was recorded.
    """
    page = Page(
        result.scenario.heading,
        subtitle=result.scenario.subject,
        command=_commands(file),
        versions=result.versions,
        verdict=verdict(summary, () if beside is None else beside.worse),
        cover=result.scenario.report,
    )
    for title, add in subjects(result, summary, beside).items():
        add(page.section(title))
    _add_scenario(page.section("Scenario"), result)
    return page


def subjects(result: Result, summary: Summary, beside: Beside | None = None) -> dict[str, Callable[[Section], None]]:
    """What is shown of a collision, but its scenario: by the title of a section, what fills it.

    Raises:
        InputError: if nothing was recorded.
    """
    if len(result.time) < 2:
        raise InputError("the result has fewer than two recorded times, too few for a report")
    chain = result.chain
    found: dict[str, Callable[[Section], None]] = {
        "Outcome": lambda section: _add_outcome(
            section, chain, summary, () if beside is None else beside.tables(chain)
        ),
        ANIMATED: lambda section: add_animation(section, result),
        "Interfaces and vehicles": lambda section: _add_parts(section, chain, summary),
    }
    if chain.plane:
        found["In the vertical plane"] = lambda section: add_plane(section, result, summary)
    if chain.members:
        found["Bodies"] = lambda section: add_bodies(section, result, summary)
    found["Over time"] = lambda section: add_histories(section, result)
    if chain.free_flights:
        found["Occupants"] = lambda section: add_occupants(section, result)
    found["Devices"] = lambda section: add_devices(section, result)
    found["Checks"] = lambda section: _add_checks(section, result, summary)
    return found


def _commands(file: Path | None) -> str:
    again = (
        "the collision again: save the scenario above as scenario.yaml\ntrainmj run scenario.yaml --out again --report"
    )
    if file is None:
        return f"# {again}"
    folder = file.resolve().parent.name
    results = folder if file.name == "result.nc" else f"{folder}/{file.name}"
    return f"trainmj report {quote(results)}\n\n# {again}"


def _add_parts(section: Section, chain: Chain, summary: Summary) -> None:
    section.table(tables.interfaces(summary))
    for table in tables.vehicles(chain, summary):
        section.table(table)
    if contacts := tables.contacts(summary):
        section.table(contacts, folded=len(contacts.rows) > _MOST_ROWS)


def _add_checks(section: Section, result: Result, summary: Summary) -> None:
    section.table(tables.checks(result, summary))
    section.table(tables.energy(summary))
    for remark in summary.remarks:
        section.text(remark)


def _add_outcome(section: Section, chain: Chain, summary: Summary, beside: Iterable[Table]) -> None:
    limits = summary.limits
    kept = sum(c.kept for c in limits)
    worst = max(summary.vehicles, key=lambda v: v.peak_device_acceleration_g)
    b = summary.balance
    absorbed = f"of {readable(b.kinetic_start_kJ, 0)} kJ before the impact"
    if "bodies_kJ" in b.values:
        absorbed = f"by the devices, {readable(b.bodies_kJ, 0)} kJ by car bodies, {absorbed}"
    invalid = failed(summary.not_valid) if summary.not_valid else None
    if invalid:
        section.facts({"NOT VALID": failed(f"after {summary.valid_until_s:.4g} s: {tables.why_not_valid(summary)}")})
    section.cards(
        Card(
            "Status",
            f"{summary.duration_s:.3f}",
            "s simulated",
            MEANING[summary.status.kind],
            tables.outcome(summary.status.kind),
        ),
        Card(
            "Limits",
            f"{kept} of {len(limits)}" if limits else "none",
            "kept" if limits else "stated",
            verdict=(invalid or judged(kept == len(limits), "all are kept", "not all are kept")) if limits else None,
        ),
        Card("TS", readable(summary.TS_mm, 1), "mm", "compression along the moving train, no empty strokes", invalid),
        Card("TAMA", f"{summary.TAMA_g:.3f}", "g", "mean of its peak device accelerations", invalid),
        Card(
            "Largest peak",
            f"{worst.peak_device_acceleration_g:.3f}",
            "g",
            f"device acceleration of {worst.name}",
            invalid,
        ),
        Card("Absorbed", readable(b.absorbed_kJ, 0), "kJ", absorbed, invalid),
        *(
            Card(
                quantity.heading.capitalize(),
                quantity.text(summary.values[quantity.name]),
                quantity.unit or "N/N0",
                quantity.meaning,
                invalid,
            )
            for quantity in TRAIN
            if quantity.key in _OF_PLANE and quantity.name in summary.values
        ),
    )
    if summary.status.detail:
        section.text(f"Status: {summary.status}.")
    add_used(section, chain, summary)
    if limits:
        section.table(tables.limits(limits).marked(summary.not_valid))
        section.text(
            "The limits are the scenario's: those of responses for the moving train, those of strokes for every "
            "device that has one. The clauses of EN 15227 are not checked, and no compliance is claimed."
        )
    for table in beside:
        section.table(table)


def _add_scenario(section: Section, result: Result) -> None:
    scenario, chain = result.scenario, result.chain
    c, s = scenario.collision, scenario.simulation
    partner = f"{c.partner_speed_km_h:g} km/h" if c.partner_speed_km_h else "standing"
    obstacle = scenario.obstacles.get(c.partner)
    if c.partner == RIGID_WALL:
        struck = "rigid wall"
    elif obstacle is None:
        struck = f"{c.partner}, {partner}, struck at its {c.partner_end}"
    else:
        struck = f"{c.partner}, fixed obstacle" if obstacle.fixed else f"{c.partner}, free obstacle, {partner}"
    if scenario.notes:
        section.text(scenario.notes)
    section.facts(
        {
            "Train": f"{c.train}, {c.speed_km_h:g} km/h, led by its {c.train_end}",
            "Partner": struck,
            "Gap at the start": f"{c.gap_mm:g} mm",
            "Grade": f"{c.grade_per_mille:g} per mille, positive uphill along the motion",
            "Step": f"{s.step_ms:g} ms ({s.integrator}), recorded every {s.record_every_ms:g} ms",
            **({"Averaged over": f"windows of {s.averaging_ms:g} ms"} if s.averaging_ms else {}),
            **({"Plane": f"vertical, ties {scenario.ties}"} if chain.plane else {}),
            "Time limit": f"{s.time_limit_s:g} s",
        }
    )
    section.table(tables.vehicles_of(chain), folded=len(chain.vehicles) > _MOST_ROWS)
    if chain.members:
        section.table(tables.bodies_of(chain))
    if chain.plane:
        section.table(tables_plane.gear_of(chain))
        section.table(tables_plane.lines_of(chain))
    if scenario.sources:
        section.table(sources_table(scenario.sources, scenario.values()), folded=len(scenario.sources) > _MOST_ROWS)
    section.code(to_yaml(scenario), "scenario.yaml")
