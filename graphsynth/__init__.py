"""graphsynth: from an integer equation to a proved verdict.

``import graphsynth`` loads this file and the table of methods (`graphsynth.core.shown`): every public name is resolved
on first use (PEP 562), so that a script pays only for what it asks.
"""

import lazy_loader as _lazy

from .core import shown as _shown

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)

# the methods whose work is done above the room of their object; this file lies above all rooms
_shown.WORK.update(
    {
        "simulate": "graphsynth.kinematics.simulation:simulate",
        "modes": "graphsynth.kinematics.engine.start:assembly_modes",
        "assess jamming": "graphsynth.jamming.assess:assess_jamming",
        "binding torque": "graphsynth.jamming.binding.torque:binding_torque",
        "static forces": "graphsynth.dynamics.inverse:static_forces",
        "embody": "graphsynth.kinematics.dimensional.api:embody",
        "draw graph": "graphsynth.drawing.methods:draw_graph",
        "draw multiple joints": "graphsynth.drawing.methods:draw_multiple_joints",
        "mechanism of gear train": "graphsynth.mechanism.geared_trains:train_mechanism",
        "draw gear train": "graphsynth.drawing.methods:draw_gear_train",
        "draw sliders": "graphsynth.drawing.methods:draw_sliders",
        "graph picture": "graphsynth.drawing.methods:graph_picture",
        "open mechanism": "graphsynth.workbench.opening:open_workbench",
        "draw mechanism": "graphsynth.drawing.methods:draw_posed",
        "plot mechanism": "graphsynth.drawing.methods:plot_posed",
        "mechanism picture": "graphsynth.drawing.methods:mechanism_picture",
        "draw motion": "graphsynth.drawing.methods:draw_motion",
        "plot motion": "graphsynth.drawing.methods:plot_motion",
        "animate motion": "graphsynth.drawing.methods:animate_motion",
        "chart burmester": "graphsynth.drawing.burmester:burmester_chart",
        "chart": "graphsynth.drawing.plots:Chart",
        "chart line": "graphsynth.drawing.plots:Line",
        "chart band": "graphsynth.drawing.plots:Band",
        "motion picture": "graphsynth.drawing.methods:motion_picture",
        "parts": "graphsynth.design.parts.api:parts",
        "draw parts": "graphsynth.drawing.parts_picture:draw_parts",
        "write parts": "graphsynth.formats.parts_files:write_parts",
    }
)
