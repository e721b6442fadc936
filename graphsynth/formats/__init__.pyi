from .engine_run import EngineRun as EngineRun
from .export_certificate import (
    ExportCertificate as ExportCertificate,
)
from .export_certificate import (
    Trial as Trial,
)
from .export_certificate import (
    certify_export as certify_export,
)
from .exudyn_model import (
    ExudynModel as ExudynModel,
)
from .exudyn_model import (
    ExudynSettings as ExudynSettings,
)
from .exudyn_model import (
    run_exudyn as run_exudyn,
)
from .exudyn_model import (
    to_exudyn as to_exudyn,
)
from .matrices import (
    adjacency_matrix as adjacency_matrix,
)
from .matrices import (
    graph_from_adjacency as graph_from_adjacency,
)
from .matrices import (
    graph_from_incidence as graph_from_incidence,
)
from .matrices import (
    incidence_matrix as incidence_matrix,
)
from .mjcf import (
    MjcfModel as MjcfModel,
)
from .mjcf import (
    MujocoSettings as MujocoSettings,
)
from .mjcf import (
    to_mjcf as to_mjcf,
)
from .mujoco_run import run_mujoco as run_mujoco
from .registry import (
    FORMATS as FORMATS,
)
from .registry import (
    GRAPHS_MAX as GRAPHS_MAX,
)
from .registry import (
    JOINTS_MAX as JOINTS_MAX,
)
from .registry import (
    Format as Format,
)
from .registry import (
    format_of as format_of,
)
from .registry import (
    read as read,
)
from .registry import (
    read_all as read_all,
)
from .registry import (
    read_stream as read_stream,
)
from .registry import (
    read_text as read_text,
)
from .registry import (
    write as write,
)
from .registry import (
    write_text as write_text,
)
from .trees import (
    SpanningTree as SpanningTree,
)
from .trees import (
    spanning_tree as spanning_tree,
)
