"""Words of a task: dyads alone, limits of time, the direction of the crank, symmetry."""

from __future__ import annotations

from dataclasses import replace

from graphsynth.core.limits import Clock, here, told
from graphsynth.design import DesignTask, PathTarget, design
from graphsynth.design.task.plans import Plan, plans


def test_a_limit_of_processor_time_ends_the_search() -> None:
    task = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0), count=12, tolerance=1e-7)], links=[4])
    found = design(task, processor_seconds=1e-3)
    assert found.pieces == 1 and "the limit of processor time was reached" in found.statement


def test_processor_time_of_other_processes_counts() -> None:
    clock = Clock(1e6, 1e5)
    result, more = told(lambda n: sum(range(n)), "another process", 200_000)
    assert result == 199_999 * 100_000 and more > 0.0
    assert told(abs, here(), -1) == (1, 0.0)
    assert clock.over == ""
    clock.elsewhere += 1e5
    assert clock.over == "the limit of processor time"


def test_dyads_alone_leave_out_what_cannot_be_assembled_two_links_at_a_time() -> None:
    """By brute force: place two links at a time that are joined to each other and to what is placed."""

    def two_by_two(plan: Plan) -> bool:
        graph = plan.design.graph
        placed = {graph.frame, plan.design.drivers[0][1]}
        while len(placed) < graph.links:
            pair = next(
                (
                    (a, b)
                    for a, b, _ in graph.joints
                    if not {a, b} & placed
                    and all(any({n, k} in ({*j[:2]} for j in graph.joints) for n in placed) for k in (a, b))
                ),
                None,
            )
            if pair is None:
                return False
            placed |= {*pair}
        return True

    free = DesignTask(targets=[PathTarget.segment((0, 0), (4, 0))], links=[6])
    every = list(plans(free, 6))
    kept = list(plans(replace(free, dyads_only=True), 6))
    assert kept == [plan for plan in every if two_by_two(plan)] and 0 < len(kept) < len(every)
