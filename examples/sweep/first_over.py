"""Read the table of a sweep and print from which speed on a stroke limit is passed: `python first_over.py FOLDER`."""

import sys

import trainmj

table = trainmj.read_table(sys.argv[1])
for friction, rows in table.groupby("collision.rail_friction"):
    over = rows[rows["status"] == "stroke exhausted"].sort_values("speed_km_h")
    if over.empty:
        print(f"friction {friction:g}: no limit is passed")
    else:
        first = over.iloc[0]
        print(f"friction {friction:g}: from {first['speed_km_h']:g} km/h on, {first['status']} {first['reason']}")
