from .assess import JammingReport as JammingReport, JammingTable as JammingTable, assess_jamming as assess_jamming
from .bearing.arcs import (
    ArcEnclosure as ArcEnclosure,
    CertifiedArcs as CertifiedArcs,
    Enclosure as Enclosure,
    JamArc as JamArc,
    JamArcs as JamArcs,
    Span as Span,
    jam_arcs as jam_arcs,
)
from .bearing.bearing import Bearing as Bearing, CriticalTilt as CriticalTilt
from .bearing.branch_and_bound import (
    Samples as Samples,
    Supremum as Supremum,
    largest_interference as largest_interference,
    maximise as maximise,
    sample_interference as sample_interference,
)
from .bearing.certify import JamCertificate as JamCertificate, Witness as Witness, certify_jamming as certify_jamming
from .bearing.fits import (
    STANDARD_FITS as STANDARD_FITS,
    Fit as Fit,
    FitVerdict as FitVerdict,
    assess_fits as assess_fits,
    tightest_free_fit as tightest_free_fit,
)
from .bearing.friction import (
    InsertionDiagram as InsertionDiagram,
    Region as Region,
    Wedging as Wedging,
    WedgingReport as WedgingReport,
    insertion_diagram as insertion_diagram,
    wedging as wedging,
)
from .bearing.limits import (
    CertifiedLimit as CertifiedLimit,
    Limit as Limit,
    certified_largest_height as certified_largest_height,
    certified_largest_misalignment as certified_largest_misalignment,
    certified_smallest_clearance as certified_smallest_clearance,
    largest_height as largest_height,
    largest_misalignment as largest_misalignment,
    smallest_clearance as smallest_clearance,
)
from .bearing.parameters import Range as Range, ToleranceBox as ToleranceBox, spread as spread
from .bearing.sweep import TurnPartition as TurnPartition, sweep_linkage as sweep_linkage, sweep_turn as sweep_turn
from .binding import binding_torque as binding_torque, unclosed_motion as unclosed_motion
from .binding.parts import (
    ContactFriction as ContactFriction,
    JointStiffness as JointStiffness,
    LinkSection as LinkSection,
)
from .binding.report import BindingReport as BindingReport, JointWear as JointWear
from .chance.allocation import (
    Allocation as Allocation,
    Grade as Grade,
    ParetoCurve as ParetoCurve,
    allocate_tolerances as allocate_tolerances,
    pareto_curve as pareto_curve,
)
from .chance.distributions import Distribution as Distribution
from .chance.probability import (
    CommonFactor as CommonFactor,
    JammingProbability as JammingProbability,
    SampledProbability as SampledProbability,
    SensitivityOfProbability as SensitivityOfProbability,
    ToleranceEffect as ToleranceEffect,
    probability_of_jamming as probability_of_jamming,
)
from .margins.margin import JointsMargin as JointsMargin, joints_margin as joints_margin
from .questions import (
    certified_arcs as certified_arcs,
    compare_sensitivities as compare_sensitivities,
    direction_map as direction_map,
    largest_scale as largest_scale,
)
from .verdict import Verdict as Verdict
