from .parts import ContactFriction as ContactFriction, JointStiffness as JointStiffness, LinkSection as LinkSection
from .report import BindingReport as BindingReport, JointWear as JointWear
from .shifts import unclosed_motion as unclosed_motion
from .torque import binding_torque as binding_torque
