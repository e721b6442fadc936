from .bearing import (
    ErrorRow as ErrorRow,
)
from .bearing import (
    arc_errors as arc_errors,
)
from .bearing import (
    area_errors as area_errors,
)
from .bearing import (
    crossing_errors as crossing_errors,
)
from .bearing import (
    error_table as error_table,
)
from .choice import (
    Knee as Knee,
)
from .choice import (
    advice as advice,
)
from .choice import (
    front as front,
)
from .choice import (
    knee as knee,
)
from .choice import (
    knees as knees,
)
from .mechanism_accuracy import dynamics_work_precision as dynamics_work_precision
from .pictures import work_precision_picture as work_precision_picture
from .report import (
    AccuracyReport as AccuracyReport,
)
from .report import (
    measure as measure,
)
from .report import (
    write_report as write_report,
)
from .rows import (
    Effort as Effort,
)
from .rows import (
    Problem as Problem,
)
from .rows import (
    Row as Row,
)
from .rows import (
    RowStatus as RowStatus,
)
from .rows import (
    table as table,
)
