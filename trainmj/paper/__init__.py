"""The published tables of Liu et al. 2022 (doi 10.1186/s10033-022-00755-8), as CSV files in ``published/``.

Heads carry the units; numbers have the digits that the paper prints.
"""
