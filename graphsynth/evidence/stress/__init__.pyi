from .cases import Case as Case, stress_cases as stress_cases
from .checks import CaseStatus as CaseStatus, Check as Check, Checks as Checks
from .running import (
    CaseOutcome as CaseOutcome,
    StressReport as StressReport,
    run_case as run_case,
    run_stress as run_stress,
)
