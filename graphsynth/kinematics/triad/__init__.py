"""All assembly modes of a link on three legs (3-RPR): the direct problem that closes triads and platforms."""
