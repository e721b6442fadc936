"""One module per family of mechanisms, each with a constant ``FAMILY`` (see :mod:`graphsynth.scenes.family`)."""
