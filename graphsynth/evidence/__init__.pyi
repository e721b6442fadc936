from .choice import Knee as Knee, advice as advice, front as front, knee as knee, knees as knees
from .crossing import area_problem as area_problem, crossing_problem as crossing_problem
from .dynamics import dynamics_work_precision as dynamics_work_precision
from .jamming import arc_problem as arc_problem
from .pictures import work_precision_picture as work_precision_picture
from .report import AccuracyReport as AccuracyReport, measure as measure, write_report as write_report
from .rows import Effort as Effort, Problem as Problem, Row as Row, RowStatus as RowStatus
