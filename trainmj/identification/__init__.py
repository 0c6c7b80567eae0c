"""Identification: the values of a scenario that make its responses meet values from any source.

::

    from trainmj.identification import identify, load_targets

    found = identify(load_targets("b_type"), "out")
    print(found.parameters)

A targets file states the scenario, the parameters sought with their bounds and constraints, the targets, tables of
values for them, and tables that are held out to check. docs/identification.md explains every key.
"""

from trainmj.identification.found import Found
from trainmj.identification.plan import Identification, load_targets, targets_of
from trainmj.identification.run import identify

__all__ = ["Found", "Identification", "identify", "load_targets", "targets_of"]
