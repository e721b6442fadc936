from .certified_assembly_modes import (
    AssemblyCertificate as AssemblyCertificate,
    AssemblyVerdict as AssemblyVerdict,
    ModeEnclosure as ModeEnclosure,
    certify_assembly_modes as certify_assembly_modes,
    certify_direct as certify_direct,
)
from .certified_full_turn import (
    FullTurnCertificate as FullTurnCertificate,
    TurnVerdict as TurnVerdict,
    certify_full_turn as certify_full_turn,
)
from .certified_modes_batch import (
    AssemblyCertificateBatch as AssemblyCertificateBatch,
    certify_assembly_modes_batch as certify_assembly_modes_batch,
    certify_direct_batch as certify_direct_batch,
)
from .motor_model import MotorDrivenPlatform as MotorDrivenPlatform
from .resistance import resistance_effect as resistance_effect
