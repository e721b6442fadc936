"""Parts that make a mechanism: outlines with holes, layers without collisions, pins, bill of parts."""
