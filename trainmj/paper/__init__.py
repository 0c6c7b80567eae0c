"""Liu et al. 2022 (doi 10.1186/s10033-022-00755-8), computed again and set beside what it prints."""

PAGE = "paper.html"
"""The page, beside the tables and figures."""

BEYOND = "beyond.html"
"""The page of what is beyond the paper's range."""
