"""A small atlas page, and a real Chromium to look at it."""

import shutil

import pytest

from graphsynth.atlas.catalogue import Catalogue
from graphsynth.atlas.site import build_site

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
)  # fmt: skip


@pytest.fixture(scope="session")
def catalogue(built, tmp_path_factory):
    with Catalogue(built(tmp_path_factory.mktemp("atlas"), range(4, 9))) as small:
        yield small


@pytest.fixture(scope="session")
def report(catalogue, tmp_path_factory):
    return build_site(catalogue, tmp_path_factory.mktemp("page") / "atlas", motion_links=4)


def start(downloads):
    """Chromium with its driver, or a skipped test."""
    webdriver = pytest.importorskip("selenium.webdriver")
    from selenium.webdriver.chrome.service import Service

    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if not chromium or not driver:
        pytest.skip("no Chromium with chromedriver on this machine")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    found = webdriver.Chrome(options=options, service=Service(driver))
    found.set_script_timeout(60)
    size = {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    found.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    found.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(downloads)})
    return found


@pytest.fixture(scope="session")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="session")
def window(downloads):
    """One window for all tests of the session."""
    found = start(downloads)
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
