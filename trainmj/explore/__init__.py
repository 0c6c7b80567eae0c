"""A scenario that answers at once, on a page of this machine: its values as sliders, and what the collision says.

``values`` finds the numbers and curves that may be changed, ``session`` computes what a change does, ``page`` is what
the browser shows, and ``server`` hands it over.
"""
