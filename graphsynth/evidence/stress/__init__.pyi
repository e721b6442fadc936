from .cases import (
    Case as Case,
)
from .cases import (
    stress_cases as stress_cases,
)
from .checks import (
    Check as Check,
)
from .checks import (
    Checks as Checks,
)
from .checks import (
    Status as Status,
)
from .running import (
    Outcome as Outcome,
)
from .running import (
    StressReport as StressReport,
)
from .running import (
    run_case as run_case,
)
from .running import (
    run_stress as run_stress,
)
