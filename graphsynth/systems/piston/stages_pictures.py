"""Pictures of the floating piston: diagrams in two poses, with and without the second group; curves; animations."""

from __future__ import annotations

from graphsynth.pipeline.products import Picture
from graphsynth.pipeline.stages import Context
from graphsynth.systems.piston.stages import machines_of, table_of, words_of

_POSES = (1.0, 4.0)


def sketches(context: Context) -> tuple[Picture, ...]:
    """Draw every machine in two poses, and its plain form."""
    from graphsynth.drawing.sketch import degrees
    from graphsynth.systems.piston.pictures import piston_sketch

    pictures = []
    for kind, machine in machines_of(context):
        name = words_of(kind)
        for angle in _POSES:
            caption = (
                "Links: 1 crank, 2 rod or block, 3 crosshead or yoke on its guide, 4 piston. The piston is held by "
            )
            caption += "the cylinder and by the slot of the crosshead, nothing else."
            svg = piston_sketch(machine.mechanism, angle, width=620.0).svg()
            title = f"{name[0].upper()}{name[1:]} with floating piston, crank at {degrees(angle)}"
            pictures.append(Picture(title, svg, caption if angle == _POSES[0] else ""))
        plain = piston_sketch(machine.mechanism.without_group(), _POSES[0], width=620.0).svg()
        pictures.append(Picture(f"{name[0].upper()}{name[1:]} with plain piston", plain, "For comparison."))
    return tuple(pictures)


def animations(context: Context) -> tuple[Picture, ...]:
    """Let every machine turn in the page."""
    from graphsynth.systems.piston.pictures import piston_animated_svg

    caption = "Symbols of ISO 3952; the small slider on the piston is its slot in the crosshead."
    return tuple(
        Picture(f"One turn: {words_of(kind)}", piston_animated_svg(machine.mechanism), caption)
        for kind, machine in machines_of(context)
    )


def plots(context: Context) -> tuple[Picture, ...]:
    """Motion, side loads, torque, reactions, gas force."""
    from graphsynth.systems.piston import pictures as charts

    table = table_of(context)
    length = None if table.piston_length_mm is None else table.piston_length_mm / 1e3
    pictures = []
    for kind, machine in machines_of(context):
        name = words_of(kind)
        loads = "Dashed: the plain piston. The floating one's crosshead takes over what the cylinder loses."
        pictures += [
            Picture(f"Side load, {name}", charts.side_load_chart(machine, length).svg(), loads),
            Picture(f"Reactions, {name}", charts.reaction_chart(machine).svg(), "Path of the tip of every force."),
            *(
                Picture(f"{word}, {name}", charts.piston_motion_chart(machine.mechanism, order).svg())
                for order, word in enumerate(("Displacement", "Velocity", "Acceleration"))
            ),
            Picture(f"Torque of the motor, {name}", charts.torque_chart(machine).svg()),
            Picture(f"Gas force, {name}", charts.indicator_chart(machine).svg(), "Its area is the work of a turn."),
        ]
    return tuple(pictures)
