"""What a mechanism is, combinatorially: the integer system, graphs, keys, rigid sub-chains, structural groups."""
