"""A result beside another one, or beside a test: how far their channels differ, and whether rules are kept.

In reading order::

    sides          channels of a result
    recorded       channels of a test, from a table or an ISO-MME folder
    differences    of a channel of both; the shift of a clock
    rules          what the validation of a model by EN 15227 speaks of
    found          both together
    tables, screen, figures, page, folder    how they are shown
"""

from trainmj.comparison.found import Comparison as Comparison
from trainmj.comparison.found import compare as compare
