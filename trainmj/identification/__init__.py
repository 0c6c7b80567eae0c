"""Identification: values of a scenario with which the simulation reproduces known responses.

::

    found = trainmj.identify(trainmj.load_targets("b_type"), "out")
    print(found.parameters)

A targets file states a scenario, parameters with their bounds and constraints, targets, tables of values for them, and
tables that are held out for a check; see docs/identification.md.
"""

from trainmj.identification.found import Found
from trainmj.identification.plan import Identification, load_targets, targets_of
from trainmj.identification.run import identify

__all__ = ["Found", "Identification", "identify", "load_targets", "targets_of"]
