from .certified_assembly_modes import (
    AssemblyCertificate as AssemblyCertificate,
)
from .certified_assembly_modes import (
    AssemblyVerdict as AssemblyVerdict,
)
from .certified_assembly_modes import (
    ModeEnclosure as ModeEnclosure,
)
from .certified_assembly_modes import (
    certify_assembly_modes as certify_assembly_modes,
)
from .certified_assembly_modes import (
    certify_direct as certify_direct,
)
from .certified_full_turn import (
    FullTurnCertificate as FullTurnCertificate,
)
from .certified_full_turn import (
    TurnVerdict as TurnVerdict,
)
from .certified_full_turn import (
    certify_full_turn as certify_full_turn,
)
from .certified_modes_batch import (
    AssemblyCertificateBatch as AssemblyCertificateBatch,
)
from .certified_modes_batch import (
    certify_assembly_modes_batch as certify_assembly_modes_batch,
)
from .certified_modes_batch import (
    certify_direct_batch as certify_direct_batch,
)
from .motor_model import MotorDrivenPlatform as MotorDrivenPlatform
from .resistance import resistance_effect as resistance_effect
