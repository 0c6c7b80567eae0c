"""How long an assessment takes: its cases as one batch, against the same collisions one after the other.

::

    python benchmarks/assessment.py

The train is an eight-car one with seats, C-I after EN 15227: three collision scenarios, both ends, three load states.
Times are of one process after a first assessment, which compiles and loads the law; the least of several, in turns.
"""

from __future__ import annotations

import time

import trainmj

ROUNDS = 5


def main() -> None:
    """Print the times and their ratio."""
    changes = {"trains.main_line.load": {"seats": 60, "share": 0.0, "kg": 80}}
    train, standard = trainmj.load("en15227_c1", changes), trainmj.load_assessment("en15227")

    def batch() -> int:
        return len(trainmj.assess(train, standard, "C-I").outcomes)

    scenarios = [o.case.scenario for o in trainmj.assess(train, standard, "C-I").outcomes if o.case.scenario]

    def singly() -> int:
        return len([trainmj.summarise(trainmj.run(scenario)) for scenario in scenarios])

    times: dict[str, list[float]] = {"as one batch": [], "one by one": []}
    for _ in range(ROUNDS):
        for name, work in (("as one batch", batch), ("one by one", singly)):
            began = time.perf_counter()
            count = work()
            times[name].append(time.perf_counter() - began)
    for name, taken in times.items():
        print(f"{count} cases {name}: {min(taken):.3f} s (of {ROUNDS}: {', '.join(f'{t:.3f}' for t in taken)})")
    print(f"ratio {min(times['one by one']) / min(times['as one batch']):.2f}")


if __name__ == "__main__":
    main()
