from .assess import (
    JammingReport as JammingReport,
)
from .assess import JammingTable as JammingTable
from .assess import (
    assess_jamming as assess_jamming,
)
from .bearing.arcs import (
    ArcEnclosure as ArcEnclosure,
)
from .bearing.arcs import (
    CertifiedArcs as CertifiedArcs,
)
from .bearing.arcs import (
    Enclosure as Enclosure,
)
from .bearing.arcs import (
    JamArc as JamArc,
)
from .bearing.arcs import (
    JamArcs as JamArcs,
)
from .bearing.arcs import Span as Span
from .bearing.arcs import (
    jam_arcs as jam_arcs,
)
from .bearing.bearing import (
    Bearing as Bearing,
)
from .bearing.bearing import (
    CriticalTilt as CriticalTilt,
)
from .bearing.branch_and_bound import (
    Samples as Samples,
)
from .bearing.branch_and_bound import (
    Supremum as Supremum,
)
from .bearing.branch_and_bound import (
    largest_interference as largest_interference,
)
from .bearing.branch_and_bound import (
    maximise as maximise,
)
from .bearing.branch_and_bound import (
    sample_interference as sample_interference,
)
from .bearing.certify import (
    JamCertificate as JamCertificate,
)
from .bearing.certify import (
    Witness as Witness,
)
from .bearing.certify import certify_jamming as certify_jamming
from .bearing.fits import (
    STANDARD_FITS as STANDARD_FITS,
)
from .bearing.fits import (
    Fit as Fit,
)
from .bearing.fits import (
    FitVerdict as FitVerdict,
)
from .bearing.fits import (
    assess_fits as assess_fits,
)
from .bearing.fits import (
    tightest_free_fit as tightest_free_fit,
)
from .bearing.friction import (
    InsertionDiagram as InsertionDiagram,
)
from .bearing.friction import (
    Region as Region,
)
from .bearing.friction import (
    Wedging as Wedging,
)
from .bearing.friction import (
    WedgingReport as WedgingReport,
)
from .bearing.friction import (
    insertion_diagram as insertion_diagram,
)
from .bearing.friction import (
    wedging as wedging,
)
from .bearing.limits import (
    CertifiedLimit as CertifiedLimit,
)
from .bearing.limits import (
    Limit as Limit,
)
from .bearing.limits import (
    certified_largest_height as certified_largest_height,
)
from .bearing.limits import (
    certified_largest_misalignment as certified_largest_misalignment,
)
from .bearing.limits import (
    certified_smallest_clearance as certified_smallest_clearance,
)
from .bearing.limits import (
    largest_height as largest_height,
)
from .bearing.limits import (
    largest_misalignment as largest_misalignment,
)
from .bearing.limits import (
    smallest_clearance as smallest_clearance,
)
from .bearing.parameters import (
    Range as Range,
)
from .bearing.parameters import ToleranceBox as ToleranceBox
from .bearing.parameters import (
    spread as spread,
)
from .bearing.sweep import (
    TurnPartition as TurnPartition,
)
from .bearing.sweep import (
    sweep_linkage as sweep_linkage,
)
from .bearing.sweep import (
    sweep_turn as sweep_turn,
)
from .verdict import Verdict as Verdict
