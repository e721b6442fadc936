from .api import (
    count_assur_groups as count_assur_groups,
    count_baranov_trusses as count_baranov_trusses,
    count_chains as count_chains,
    count_mechanisms as count_mechanisms,
    enumerate_assur_groups as enumerate_assur_groups,
    enumerate_baranov_trusses as enumerate_baranov_trusses,
    enumerate_chains as enumerate_chains,
    enumerate_mechanisms as enumerate_mechanisms,
    sample_chains as sample_chains,
    sample_mechanisms as sample_mechanisms,
)
from .gear_trains import (
    count_planetary_gear_trains as count_planetary_gear_trains,
    enumerate_planetary_gear_trains as enumerate_planetary_gear_trains,
    sample_planetary_gear_trains as sample_planetary_gear_trains,
)
from .multiple_joints import (
    count_multiple_joint_chains as count_multiple_joint_chains,
    enumerate_multiple_joint_chains as enumerate_multiple_joint_chains,
    sample_multiple_joint_chains as sample_multiple_joint_chains,
)
from .sliders import (
    count_slider_chains as count_slider_chains,
    enumerate_slider_chains as enumerate_slider_chains,
    sample_slider_chains as sample_slider_chains,
)
from .wishes import Wishes as Wishes
