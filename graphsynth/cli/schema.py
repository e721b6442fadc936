"""``graphsynth schema``."""

from __future__ import annotations

import argparse

from graphsynth.cli import console


def run(options: argparse.Namespace) -> int:
    """Print the JSON Schema of scene files."""
    from graphsynth.pipeline.schema import schema_text

    console.put(schema_text().rstrip("\n"))
    return 0
