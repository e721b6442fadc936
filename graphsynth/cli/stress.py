"""``graphsynth stress``."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from graphsynth.cli import console

if TYPE_CHECKING:
    from graphsynth.evidence.stress import Case, StressReport

WRONG = 1
INTERRUPTED = 130


def run(options: argparse.Namespace) -> int:
    """Run the cases; exit status 1 if one of them is WRONG, 130 if Ctrl-C came, with what was run shown and written."""
    from graphsynth.evidence.stress import run_stress

    if options.list:
        return _list(options)
    if options.output:
        options.output.mkdir(parents=True, exist_ok=True)  # what cannot be written is refused now, not at the end
    with console.counting() as bar:

        def told(case: Case, number: int, total: int) -> None:
            if bar:
                bar(f"{case.name} {case.title}", number, total)

        report = run_stress(_names(options), slow=not options.fast, files=options.cases, progress=told)
    files: list[str] = []
    if options.output:
        from graphsynth.evidence.stress.page import write_report

        files = list(map(str, write_report(report, options.output)))
    if options.json:
        console.put_json({**report.summary(), "files": files})
    else:
        _show(report)
        for path in files:
            console.put(path)
    if report.not_reached:
        console.note("graphsynth: interrupted")
        return INTERRUPTED
    return WRONG if report.wrong else 0


def _names(options: argparse.Namespace) -> list[str]:
    """Return the names of cases; that of a system stands for its cases."""
    from graphsynth.pipeline.system import system, system_names

    systems = system_names()
    return [case for name in options.names for case in (system(name).cases if name in systems else ()) or (name,)]


def _list(options: argparse.Namespace) -> int:
    from graphsynth.evidence.stress import stress_cases

    chosen = stress_cases(_names(options), slow=not options.fast, files=options.cases)
    if options.json:
        console.put_json([{"name": case.name, "title": case.title, "slow": case.slow} for case in chosen])
        return 0
    for case in chosen:
        console.put(console.wrapped(f"{case.name:17} {case.title}{' (slow)' if case.slow else ''}", 18))
    return 0


def _show(report: StressReport) -> None:
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for name, width in (("case", 16), ("status", 7), ("error", 7), ("allowed", 7), ("s", 5), ("what", None)):
        words = name in ("case", "status", "what")
        given: Any = {"min_width": width} if width else {"max_width": max((console.columns() or 132) - 53, 8)}
        table.add_column(name, justify="left" if words else "right", no_wrap=True, overflow="ellipsis", **given)
    colours = {"ok": "green", "flagged": "cyan", "WRONG": "bold red", "not run": "yellow"}
    for outcome in report.outcomes:
        worst, status = outcome.worst, outcome.status.value
        error, bound = (
            (f"{worst.error:.1e}", f"{worst.bound:.1e}") if worst and worst.error == worst.error else ("", "")
        )
        said, seconds = f"[{colours[status]}]{status}[/]", f"{outcome.seconds:.2f}"
        table.add_row(outcome.case.name, said, error, bound, seconds, escape(outcome.case.title))
    if report.outcomes:
        console.screen(console.columns() or 132).print(table)
    for outcome in report.outcomes:
        if outcome.reason:
            console.put(f"{outcome.case.name}: {outcome.reason}")
        for check in outcome.checks:
            if check.status.value == "WRONG":
                console.put(f"{outcome.case.name}: {check.what}: right is {check.right}, given is {check.given}")
    console.put(report.statement)
