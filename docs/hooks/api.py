"""The pages of Python: which names they show. mkdocstrings takes the rest from the docstrings."""

from __future__ import annotations

import trainmj
import trainmj.doe

_INTRODUCTION = """# Python

```python
import trainmj

result = trainmj.run(trainmj.load("b_type", {"empty_stroke_mm": 50}))
print(trainmj.summarise(result).TS_mm)
```

Where a scenario or a result is needed, the path of its file does as well, and so does the name of a scenario that
ships: `trainmj.run("b_type")`. What cannot be meant is a `TypeError` that says what is needed. `None` for a value takes
it back.

Values inside are in SI. Other units appear at the edges only, in the names. Names that are not on these pages may
change.
"""

_STUDY = """# Python: studies on arrays

The modules of `trainmj.doe` do not know of trains: factors, points and responses are plain arrays, from any model.
"""

_GROUPS = {
    "Scenarios": ["load", "save", "Scenario"],
    "Collisions": ["run", "Result", "load_result", "summarise", "Summary", "Status", "line_up", "installed"],
    "Ties in the vertical plane": ["bracket", "margins", "Margin"],
    "Trust in a collision": ["converge", "Convergence", "repeated", "Repeated", "verify", "Verification"],
    "Comparisons": ["compare", "Comparison"],
    "Sweeps": ["run_cases", "load_sweep", "sweep_of", "grid_of", "Sweep", "run_sweep", "SweepResult", "read_table"],
    "Studies": ["load_study", "study_of", "Study", "run_study", "StudyResult"],
    "Identification": ["load_targets", "targets_of", "channels", "Identification", "identify", "Found"],
    "Reliability": [
        "load_reliability",
        "reliability_of",
        "Reliability",
        "run_reliability",
        "ReliabilityResult",
        "scenario_of_draw",
    ],
    "Assessments": ["assess", "Assessment", "load_assessment", "Standard"],
    "Reports": ["write_report"],
    "Errors": ["TrainmjError", "InputError", "OutputError", "EngineError"],
}

_FURTHER = {
    "Films": ["trainmj.view.film.render"],
    "Devices": [
        "trainmj.collision.device.Device",
        "trainmj.collision.kind.Law",
        "trainmj.collision.envelope.Envelope",
        "trainmj.collision.chain.Element",
        "trainmj.collision.press.press",
        "trainmj.collision.press.force_along",
    ],
}


def page() -> str:
    """The public names of trainmj, by what they are for."""
    listed = [name for names in _GROUPS.values() for name in names]
    if missing := set(trainmj.__all__) ^ set(listed):
        raise ValueError(f"docs/hooks/api.py: these names are public or listed, but not both: {sorted(missing)}")
    parts = [_INTRODUCTION]
    for title, names in _GROUPS.items():
        parts.append(f"## {title}")
        for name in names:
            thing = getattr(trainmj, name)
            parts.append(_directive(f"{thing.__module__}.{name}", f"trainmj.{name}"))
    for title, paths in _FURTHER.items():
        parts.append(f"## {title}")
        parts += [_directive(path, path) for path in paths]
    return "\n\n".join(parts) + "\n"


def study_page() -> str:
    """The public names of trainmj.doe."""
    things = [getattr(trainmj.doe, name) for name in trainmj.doe.__all__]
    parts = [_directive(f"{thing.__module__}.{thing.__name__}", thing.__name__, level=2) for thing in things]
    return "\n\n".join([_STUDY, *parts]) + "\n"


def _directive(path: str, heading: str, level: int = 3) -> str:
    options = {"heading": heading, "toc_label": heading, "heading_level": level}
    return "\n".join([f"::: {path}", "    options:", *(f"      {key}: {value}" for key, value in options.items())])
