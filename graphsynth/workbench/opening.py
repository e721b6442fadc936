"""Opening the page from Python: in the browser, or in a cell of a notebook."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from html import escape
from pathlib import Path

from graphsynth.mechanism.model import Mechanism
from graphsynth.workbench.writing import write_workbench


@dataclass(frozen=True, slots=True)
class OpenedWorkbench:
    """The page of one mechanism; a notebook shows it.

    Parameters
    ----------
    page : Path
        The file that holds it whole.
    """

    page: Path

    def _repr_html_(self) -> str:
        """Return a frame that runs the page's own scripts and can hand files to the reader, and nothing else."""
        return (
            f'<iframe title="Workbench" sandbox="allow-scripts allow-downloads" style="width:100%;height:640px;'
            f'border:1px solid #8794a1;border-radius:6px" srcdoc="{escape(self.page.read_text("utf-8"))}"></iframe>'
        )


def open_workbench(
    mechanism: Mechanism | None = None, path: str | Path | None = None, *, browser: bool | None = None
) -> OpenedWorkbench:
    """Lay a mechanism on the workbench and open it.

    Parameters
    ----------
    mechanism : Mechanism, optional
        An empty table by default.
    path : str or Path, optional
        File to write the page to; one among the temporary files by default.
    browser : bool, optional
        Whether to open it in the browser; by default, unless this is a notebook, whose cell shows it.

    Returns
    -------
    OpenedWorkbench

    Raises
    ------
    GraphsynthError
        As `write_workbench`.
    """
    place = Path(path) if path is not None else Path(tempfile.mkdtemp(prefix="workbench-")) / "workbench.html"
    page = write_workbench(place, mechanism, single=True)
    if browser if browser is not None else "ipykernel" not in sys.modules:
        import webbrowser

        webbrowser.open(page.resolve().as_uri())
    return OpenedWorkbench(page)
