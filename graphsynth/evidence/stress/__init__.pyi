from .cases import Case as Case, stress_cases as stress_cases
from .checks import Check as Check, Checks as Checks, Status as Status
from .running import Outcome as Outcome, StressReport as StressReport, run_case as run_case, run_stress as run_stress
