"""``python -m graphsynth``, and the program ``graphsynth``."""

import signal
import sys

signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C before the command line is there just ends the program

from graphsynth.cli import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
