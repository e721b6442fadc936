"""One tilted bearing on a four-bar linkage: contact, areas, jam arcs over a turn, verdicts with and without proof."""
