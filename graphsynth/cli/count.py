"""``graphsynth count``."""

from __future__ import annotations

import argparse
import time

from graphsynth.cli import console
from graphsynth.cli.question import problem_of
from graphsynth.synthesis.problem import processes
from graphsynth.synthesis.writing import count_with_checkpoint


def run(options: argparse.Namespace) -> int:
    """Print the count; the number stands alone on the last line."""
    begin = time.perf_counter()
    problem = problem_of(options, counted=True)
    if problem.reason:
        console.note(f"nothing to count: {problem.reason}")
    size = sum(part.weight for part in problem.parts())
    try:
        with (
            processes(console.workers_for(options.workers, size > 100_000)) as executor,
            console.progress("counting") as watch,
        ):
            count = count_with_checkpoint(
                problem, shard=options.shard, checkpoint=options.checkpoint, executor=executor, watch=watch
            )
    except KeyboardInterrupt:
        if options.checkpoint:
            console.note(f"{options.checkpoint} keeps what was counted: give the same command to go on")
        raise
    seconds = time.perf_counter() - begin
    shard = f"{options.shard[0]}/{options.shard[1]}" if options.shard else None
    if options.json:
        number = count if isinstance(count, int) else str(count)
        document = {"question": problem.title, "shard": shard, "count": number, "seconds": round(seconds, 3)}
        console.put_json(document | ({"reason": problem.reason} if problem.reason else {}))
        return 0
    console.put(f"{problem.title}{f' shard {shard}' if shard else ''} ({seconds:.2f} s)")
    console.put(str(count))
    return 0
