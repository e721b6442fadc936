from .opening import OpenedWorkbench as OpenedWorkbench, open_workbench as open_workbench
from .writing import write_workbench as write_workbench
