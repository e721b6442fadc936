from .api import (
    count_assur_groups as count_assur_groups,
)
from .api import (
    count_baranov_trusses as count_baranov_trusses,
)
from .api import (
    count_chains as count_chains,
)
from .api import (
    count_mechanisms as count_mechanisms,
)
from .api import (
    enumerate_assur_groups as enumerate_assur_groups,
)
from .api import (
    enumerate_baranov_trusses as enumerate_baranov_trusses,
)
from .api import (
    enumerate_chains as enumerate_chains,
)
from .api import (
    enumerate_mechanisms as enumerate_mechanisms,
)
from .api import (
    sample_mechanisms as sample_mechanisms,
)
