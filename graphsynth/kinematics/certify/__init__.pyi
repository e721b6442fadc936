from .four_bar import (
    CrankCertificate as CrankCertificate,
    certify_four_bar as certify_four_bar,
    certify_inverted_slider_crank as certify_inverted_slider_crank,
    certify_slider_crank as certify_slider_crank,
)
from .modes import ModesCertificate as ModesCertificate, certify_modes as certify_modes
from .poses import MotionCertificate as MotionCertificate, certify as certify
