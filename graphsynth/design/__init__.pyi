from .curves.index import CurveIndex as CurveIndex
from .curves.matches import CurveMatch as CurveMatch, CurveStart as CurveStart
from .nine_points.linkages import PathLinkage as PathLinkage
from .nine_points.proof import ProvedRoots as ProvedRoots
from .nine_points.solutions import NinePointSolutions as NinePointSolutions, four_bars_through as four_bars_through
from .parts.collisions import Collision as Collision
from .parts.outline import Corner as Corner, Moments as Moments, Rounded as Rounded
from .parts.plan import PartSizes as PartSizes, PartsPlan as PartsPlan, Pin as Pin, Sizes as Sizes
from .parts.result import BillRow as BillRow, Parts as Parts
from .poses.cognates import Cognate as Cognate, cognates as cognates
from .poses.curves import (
    BurmesterCurve as BurmesterCurve,
    BurmesterCurves as BurmesterCurves,
    burmester_curves as burmester_curves,
)
from .poses.dyads import PoseDyad as PoseDyad, PoseDyads as PoseDyads, dyads as dyads
from .poses.functions import function_generators as function_generators, timed_paths as timed_paths
from .poses.linkages import (
    PoseLinkage as PoseLinkage,
    PoseLinkages as PoseLinkages,
    four_bars_for_poses as four_bars_for_poses,
)
from .poses.six_bars import PoseSixBar as PoseSixBar, six_bars_for_poses as six_bars_for_poses
from .task.answers import DesignedMechanism as DesignedMechanism
from .task.search import Designs as Designs, design as design
from .task.starts import index_starts as index_starts
from .task.targets import (
    DwellTarget as DwellTarget,
    FunctionTarget as FunctionTarget,
    PathTarget as PathTarget,
    PosesTarget as PosesTarget,
    SwingTarget as SwingTarget,
)
from .task.task import DesignTask as DesignTask
