"""The study chain on plain arrays: design, correlation, surrogate, swarm, weights, decision.

It knows factors, points and responses, nothing of trains. Each step is a function of arrays that returns a frozen value
with a ``table()``:

    space       what is varied                  Factor, Space
    doe         where to compute                optimal_latin_hypercube, sobol, full_factorial, central_composite, given
    correlation what goes with what             correlate
    polynomial  what stands in for the model    fit_polynomial, select_terms
    kriging     another such                    fit_kriging
    surrogate   how good it is                  accuracy, cross_validate, compare
    sensitivity which factor matters            sobol_sensitivity
    optimize    the best compromises            mopso, hypervolume
    weights     how much each criterion counts  entropy_weights, own_weights
    decide      the one design                  weighted_sum, topsis, knee_point, weight_sensitivity
"""

from trainmj.doe.correlation import Correlation, correlate
from trainmj.doe.decision import (
    Ranking,
    WeightSensitivity,
    knee_point,
    normalise,
    topsis,
    weight_sensitivity,
    weighted_sum,
)
from trainmj.doe.designs import (
    Design,
    Quality,
    central_composite,
    full_factorial,
    given,
    optimal_latin_hypercube,
    sobol,
)
from trainmj.doe.kriging import Kriging, fit_kriging
from trainmj.doe.optimiser import Front, Progress, SwarmOptions, mopso
from trainmj.doe.pareto import hypervolume, nondominated
from trainmj.doe.polynomial import Polynomial, fit_polynomial
from trainmj.doe.selection import Selection, select_terms
from trainmj.doe.sensitivity import Sensitivity, sobol_sensitivity
from trainmj.doe.space import Factor, Space
from trainmj.doe.surrogate import Accuracy, Prediction, Surrogate, accuracy, compare, cross_validate
from trainmj.doe.terms import full_order, parse_terms
from trainmj.doe.weights import Weights, entropy_weights, own_weights, t_scores

__all__ = [
    "Accuracy",
    "Correlation",
    "Design",
    "Factor",
    "Front",
    "Kriging",
    "Polynomial",
    "Prediction",
    "Progress",
    "Quality",
    "Ranking",
    "Selection",
    "Sensitivity",
    "Space",
    "Surrogate",
    "SwarmOptions",
    "WeightSensitivity",
    "Weights",
    "accuracy",
    "central_composite",
    "compare",
    "correlate",
    "cross_validate",
    "entropy_weights",
    "fit_kriging",
    "fit_polynomial",
    "full_factorial",
    "full_order",
    "given",
    "hypervolume",
    "knee_point",
    "mopso",
    "nondominated",
    "normalise",
    "optimal_latin_hypercube",
    "own_weights",
    "parse_terms",
    "select_terms",
    "sobol",
    "sobol_sensitivity",
    "t_scores",
    "topsis",
    "weight_sensitivity",
    "weighted_sum",
]
