from .files import scenes as scenes
from .linkages import (
    FourBarLengths as FourBarLengths,
    four_bar_mechanisms as four_bar_mechanisms,
    four_bars as four_bars,
    mechanisms as mechanisms,
    platform_poses as platform_poses,
    platforms as platforms,
)
from .numbers import (
    finite_numbers as finite_numbers,
    intervals as intervals,
    intervals_and_members as intervals_and_members,
)
from .structures import chains as chains, graphs as graphs, mechanism_graphs as mechanism_graphs, specs as specs
