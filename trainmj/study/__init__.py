"""The study runner: from a study file to a chosen and verified design, each step kept in a folder.

The numerical steps are :mod:`trainmj.doe`; this package gives them trains.

    spec, rules, plan   the study file: parts, rules between them, the frozen study
    folder, simulator   what is kept: steps with their files, finished collisions
    lattice             points that are whole multiples of a resolution
    steps               design, simulations, correlation
    surrogates          what stands in for the simulation
    fronts              search on the surrogates, on the simulator, and the one against the other
    choice              weights, decision, check
    run, screen         all of it, in order; what the command prints
"""

from trainmj.study.plan import Study, load_study, shipped_studies, study_of
from trainmj.study.run import STEPS, StudyResult, Watch, run_study

__all__ = ["STEPS", "Study", "StudyResult", "Watch", "load_study", "run_study", "shipped_studies", "study_of"]
