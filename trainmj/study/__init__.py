"""Studies: from a study file to a chosen and verified design, each step kept in a folder.

The numerical methods are in :mod:`trainmj.doe`; this package applies them to trains.

    file, rules, plan         the study file: parts, rules between them, the checked study
    folder, simulator         what is kept: steps with their files, finished collisions
    designs                   what steps hand on: designs with their responses
    steps                     the scenario as it stands, design, simulations, correlation
    surrogates                what stands in for the simulation
    fronts                    searches on the surrogates and on the simulator, and their comparison
    choice                    weights, decision, check
    robust                    the same steps on statistics of many trains as built
    remarks                   what there is to know before the study is believed
    run, summary              all steps, in order, and what summary.json says of them
    tables                    what was found, told once for terminal and page
    screen, page, figures     terminal, report, pictures
"""

from trainmj.study.plan import Study, load_study, study_of
from trainmj.study.run import StudyResult, Watch, run_study

__all__ = ["Study", "StudyResult", "Watch", "load_study", "run_study", "study_of"]
