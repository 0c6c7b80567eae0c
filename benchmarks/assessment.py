"""How long an assessment takes: its cases as one batch, against the same collisions one after the other.

::

    python benchmarks/assessment.py

The train is an eight-car one with seats, C-I after EN 15227: three collision scenarios, both ends, three load states.
Times are of one process after a first assessment, which compiles and loads the law; medians of several turns.
"""

from __future__ import annotations

from turns import alternate, medians, ratio, timed

import trainmj

ROUNDS = 5


def main() -> None:
    """Print the times and their ratio."""
    changes = {"trains.main_line.load": {"seats": 60, "share": 0.0, "kg": 80}}
    train, standard = trainmj.load("en15227_c1", changes), trainmj.load_assessment("en15227")
    scenarios = [o.case.scenario for o in trainmj.assess(train, standard, "C-I").outcomes if o.case.scenario]
    taken = alternate(
        {
            "as one batch": lambda: timed(lambda: trainmj.assess(train, standard, "C-I")),
            "one by one": lambda: timed(lambda: [trainmj.summarise(trainmj.run(one)) for one in scenarios]),
        },
        ROUNDS,
    )
    for name, turns in taken.items():
        print(f"{len(scenarios)} cases {name}: {medians(turns)['wall']:.3f} s (median of {ROUNDS})")
    print(f"ratio {ratio(taken['one by one'], taken['as one batch'])['value']:.2f}")


if __name__ == "__main__":
    main()
