"""Design of experiments on plain arrays: design, correlation, surrogate, swarm, weights, decision.

Factors, points and responses are arrays of any origin. Each step is a function that returns a frozen value:

    space        what is varied                  Factor, Space, Lattice
    designs      where to compute                optimal_latin_hypercube, sobol, full_factorial, central_composite
    influence    which factor matters            correlate, sobol_sensitivity; sobol_points, sobol_indices
    terms        the terms of a polynomial       parse_terms, full_order, select_terms
    polynomial   what stands in for the model    fit_polynomial
    kriging      another such                    fit_kriging
    accuracy     how good it is                  accuracy, cross_validate
    optimiser    the best compromises            mopso
    pareto       how good they are               hypervolume, nondominated
    weights      how much each criterion counts  entropy_weights, own_weights
    decision     the one design                  weighted_sum, topsis, knee_point, weight_sensitivity
    scatter      what is not known exactly       Marginal, Scatter
    draws        samples of it                   normal_draws, replicates_of
    probability  how likely a limit is passed    proportion, quantile_interval, mean_interval, subset_simulation,
                                                 importance_sampling
"""

from trainmj.doe.accuracy import Accuracy, Surrogate, accuracy, cross_validate
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
    optimal_latin_hypercube,
    sobol,
)
from trainmj.doe.draws import normal_draws, replicates_of
from trainmj.doe.influence import (
    Correlation,
    Sensitivity,
    correlate,
    sobol_indices,
    sobol_points,
    sobol_sensitivity,
)
from trainmj.doe.kriging import Kriging, fit_kriging
from trainmj.doe.optimiser import Front, Progress, SwarmOptions, mopso
from trainmj.doe.pareto import hypervolume, nondominated
from trainmj.doe.polynomial import Polynomial, fit_polynomial
from trainmj.doe.probability import (
    Estimate,
    Rare,
    importance_sampling,
    mean_interval,
    proportion,
    quantile_interval,
    subset_simulation,
)
from trainmj.doe.scatter import Marginal, Scatter
from trainmj.doe.space import Factor, Lattice, Space
from trainmj.doe.terms import full_order, parse_terms, select_terms
from trainmj.doe.weights import Weights, entropy_weights, own_weights, t_scores

__all__ = [
    "Accuracy",
    "Correlation",
    "Design",
    "Estimate",
    "Factor",
    "Front",
    "Kriging",
    "Lattice",
    "Marginal",
    "Polynomial",
    "Progress",
    "Quality",
    "Ranking",
    "Rare",
    "Scatter",
    "Sensitivity",
    "Space",
    "Surrogate",
    "SwarmOptions",
    "WeightSensitivity",
    "Weights",
    "accuracy",
    "central_composite",
    "correlate",
    "cross_validate",
    "entropy_weights",
    "fit_kriging",
    "fit_polynomial",
    "full_factorial",
    "full_order",
    "hypervolume",
    "importance_sampling",
    "knee_point",
    "mean_interval",
    "mopso",
    "nondominated",
    "normal_draws",
    "normalise",
    "optimal_latin_hypercube",
    "own_weights",
    "parse_terms",
    "proportion",
    "quantile_interval",
    "replicates_of",
    "select_terms",
    "sobol",
    "sobol_indices",
    "sobol_points",
    "sobol_sensitivity",
    "subset_simulation",
    "t_scores",
    "topsis",
    "weight_sensitivity",
    "weighted_sum",
]
