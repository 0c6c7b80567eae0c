"""Read a sweep's table and say from which speed on a stroke limit is passed: `python first_over.py FOLDER`."""

import sys

import trainmj

table = trainmj.read_table(sys.argv[1])
for friction, rows in table.groupby("collision.rail_friction"):
    over = rows[rows["status"].str.startswith("stroke exhausted")]
    first = over.loc[over["speed_km_h"].idxmin()] if len(over) else None
    said = "no limit is passed" if first is None else f"from {first['speed_km_h']:g} km/h on: {first['status']}"
    print(f"friction {friction:g}: {said}")
