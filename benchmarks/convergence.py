"""How the results of the standard collision settle as the step gets smaller: the study behind the default step.

python benchmarks/convergence.py [SCENARIO]
"""

from __future__ import annotations

import sys
import time

import trainmj
from trainmj.chain import largest_step

STEPS_MS = (0.5, 0.25, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005)


def main() -> None:
    """Run every step and print the deviations from the smallest."""
    name = sys.argv[1] if len(sys.argv) > 1 else "b_type"
    rows = []
    for step in STEPS_MS:
        result = trainmj.run(trainmj.load(name, {"simulation.step_ms": step}))
        began = time.perf_counter()
        result = trainmj.run(trainmj.load(name, {"simulation.step_ms": step}))
        rows.append((step, trainmj.summarise(result), time.perf_counter() - began))
    fine = rows[-1][1]
    print(f"{name}: TS {fine.TS_mm:.4f} mm, TAMA {fine.TAMA_g:.5f} g at a step of {STEPS_MS[-1]} ms")
    print(f"largest stable step by the rule: {largest_step(result.chain) * 1e3:.3f} ms")
    print("\n step ms    TS mm   TAMA %  stroke mm  peak g    energy   run s")
    print("         deviation: largest of all interfaces, vehicles")
    for step, summary, taken in rows:
        stroke = max(abs(a.stroke_mm - b.stroke_mm) for a, b in zip(summary.interfaces, fine.interfaces, strict=True))
        peak = max(
            abs(a.peak_device_acceleration_g - b.peak_device_acceleration_g)
            for a, b in zip(summary.vehicles, fine.vehicles, strict=True)
        )
        print(
            f"{step:8g} {summary.TS_mm - fine.TS_mm:8.4f} {(summary.TAMA_g / fine.TAMA_g - 1) * 100:8.4f} "
            f"{stroke:9.4f} {peak:8.4f} {summary.balance.energy_error:9.1e} {taken:7.3f}"
        )


if __name__ == "__main__":
    main()
