"""A small atlas page, and a real Chromium to look at it."""

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.site import build_site
from tests.chromium import started
from tests.workbench.conftest import scripts as scripts


@pytest.fixture(scope="session")
def catalogue(built, tmp_path_factory):
    with Catalogue(built(tmp_path_factory.mktemp("atlas"), range(4, 9))) as small:
        yield small


@pytest.fixture(scope="session")
def report(catalogue, tmp_path_factory):
    return build_site(catalogue, tmp_path_factory.mktemp("page") / "atlas")


@pytest.fixture(scope="session")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="session")
def window(downloads):
    """One window for all tests of the session."""
    found = started(downloads)
    yield found
    found.quit()


@pytest.fixture
def page(window, report):
    """Open an address of the page; afterwards nothing may have been complained about in the console."""

    def open_at(address=""):
        window.get("about:blank")
        window.get(report.page.as_uri() + address)
        return window

    window.get_log("browser")
    yield open_at
    complaints = [entry["message"] for entry in window.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]
    assert not complaints
