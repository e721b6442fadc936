"""The command line: ``graphsynth VERB ...``, also ``python -m graphsynth``."""

from graphsynth.cli.main import main

__all__ = ["main"]
