from .strategies.four_bars import (
    FourBarLengths as FourBarLengths,
)
from .strategies.four_bars import (
    four_bars as four_bars,
)
from .strategies.graphs import (
    chains as chains,
)
from .strategies.graphs import (
    graphs as graphs,
)
from .strategies.graphs import (
    mechanism_graphs as mechanism_graphs,
)
from .strategies.intervals import (
    finite_numbers as finite_numbers,
)
from .strategies.intervals import (
    intervals as intervals,
)
from .strategies.intervals import (
    intervals_and_members as intervals_and_members,
)
from .strategies.mechanisms import (
    four_bar_mechanisms as four_bar_mechanisms,
)
from .strategies.mechanisms import (
    mechanisms as mechanisms,
)
from .strategies.platforms import (
    platform_poses as platform_poses,
)
from .strategies.platforms import (
    platforms as platforms,
)
from .strategies.scenes import scenes as scenes
from .strategies.specs import specs as specs
