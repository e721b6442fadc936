from .export_certificate import ExportCertificate as ExportCertificate, Trial as Trial, certify_export as certify_export
from .exporting import EngineRun as EngineRun, SpanningTree as SpanningTree, spanning_tree as spanning_tree
from .exudyn_model import (
    ExudynModel as ExudynModel,
    ExudynSettings as ExudynSettings,
    run_exudyn as run_exudyn,
    to_exudyn as to_exudyn,
)
from .matrices import (
    adjacency_matrix as adjacency_matrix,
    graph_from_adjacency as graph_from_adjacency,
    graph_from_incidence as graph_from_incidence,
    incidence_matrix as incidence_matrix,
)
from .mjcf import MjcfModel as MjcfModel, MujocoSettings as MujocoSettings, to_mjcf as to_mjcf
from .mujoco_run import run_mujoco as run_mujoco
from .parts_files import cut_svg as cut_svg, write_parts as write_parts
from .registry import (
    FORMATS as FORMATS,
    GRAPHS_MAX as GRAPHS_MAX,
    JOINTS_MAX as JOINTS_MAX,
    Format as Format,
    format_of as format_of,
    read as read,
    read_all as read_all,
    read_stream as read_stream,
    read_text as read_text,
    write as write,
    write_text as write_text,
)
