"""Assessments: whether a train passes, in every collision scenario of a standard, at both ends, laden and empty."""

from trainmj.assessment.found import Assessment
from trainmj.assessment.plan import Standard, load_assessment
from trainmj.assessment.run import assess

__all__ = ["Assessment", "Standard", "assess", "load_assessment"]
