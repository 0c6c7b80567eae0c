"""What a collision looks like: car bodies, couplers, anti-climbers and track, at true scale.

For the eye only: shapes have no mass and touch nothing. A vehicle reaches from coupler face to coupler face; its body
stands back behind both by the room that its devices need. Every device is drawn once for each side: a coupler for its
first stage, a pair of anti-climbers for those behind it. :func:`device_parts` says where each part goes as its
device is compressed; the model of a collision that has not begun has them at rest.
"""

from trainmj.shapes.parts import End, Part, device_of, device_parts, ends, setback
from trainmj.shapes.scene import add

__all__ = ["End", "Part", "add", "device_of", "device_parts", "ends", "setback"]
