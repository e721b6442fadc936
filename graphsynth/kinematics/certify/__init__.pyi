from .four_bar import (
    CrankCertificate as CrankCertificate,
)
from .four_bar import (
    certify_four_bar as certify_four_bar,
)
from .four_bar import (
    certify_inverted_slider_crank as certify_inverted_slider_crank,
)
from .four_bar import (
    certify_slider_crank as certify_slider_crank,
)
from .poses import (
    MotionCertificate as MotionCertificate,
)
from .poses import (
    Verdict as Verdict,
)
from .poses import (
    certify as certify,
)
