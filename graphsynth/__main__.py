"""``python -m graphsynth``."""

import sys

from graphsynth.cli import main

if __name__ == "__main__":
    sys.exit(main())
