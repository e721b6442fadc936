from .strategies.four_bars import FourBarLengths as FourBarLengths, four_bars as four_bars
from .strategies.graphs import chains as chains, graphs as graphs, mechanism_graphs as mechanism_graphs
from .strategies.intervals import (
    finite_numbers as finite_numbers,
    intervals as intervals,
    intervals_and_members as intervals_and_members,
)
from .strategies.mechanisms import four_bar_mechanisms as four_bar_mechanisms, mechanisms as mechanisms
from .strategies.platforms import platform_poses as platform_poses, platforms as platforms
from .strategies.scenes import scenes as scenes
from .strategies.specs import specs as specs
