"""Units at the edges: SI inside, multiply on the way in, divide on the way out."""

G = 9.80665
"""Standard gravity [m/s2], by which accelerations are reported in g."""

MM = 1e-3
KN = 1e3
KJ = 1e3
TONNE = 1e3
MS = 1e-3
KM_H = 1.0 / 3.6
KN_PER_MM = 1e6
KN_S_PER_M = 1e3
