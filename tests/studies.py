"""A small study, and changes of it, for several test files."""

import trainmj

SMALL = {
    "scenario": "b_type",
    "set": {"simulation.step_ms": 0.5},
    "factors": {
        "D": {"sets": "empty_stroke_mm", "bounds": [20, 50]},
        "M": {"sets": "mass_t", "bounds": [30, 36]},
    },
    "responses": {"TS": "TS_mm", "TAMA": "TAMA_g", "S_anti": "stroke_S1_M1_anti_climber_mm"},
    "design": {"kind": "optimal_latin_hypercube", "n": 10, "seed": 1, "resolution": {"D": 1, "M": 1}},
    "objectives": {"TS": "minimise", "TAMA": "minimise"},
    "constraints": {"S_anti": {"at_most": 265, "margin": 2}},
    "optimiser": {"on": "surrogate", "seed": 1, "surrogate": {"particles": 30, "iterations": 20}},
    "cross_validation": {"against": []},
    "decision": {"method": "topsis"},
}


def changed(values, path, value):
    """A copy with one value changed, its place given with dots; None takes it away."""
    key, _, rest = path.partition(".")
    copy = dict(values)
    if rest:
        copy[key] = changed(copy.get(key, {}), rest, value)
    elif value is None:
        del copy[key]
    else:
        copy[key] = value
    return copy


def small(**changes):
    values = SMALL
    for path, value in changes.items():
        values = changed(values, path.replace("__", "."), value)
    return trainmj.study_of(values)


def run(study, folder, **options):
    """Without figures, which take longer than all else here; the command draws them."""
    return trainmj.run_study(study, folder, figures=(), **options)
