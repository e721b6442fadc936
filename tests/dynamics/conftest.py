"""Shared models: ``from dynamic_models import ...`` works in this folder."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
