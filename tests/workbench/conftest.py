"""The scripts of the workbench in Node, and its page in a real Chromium."""

from __future__ import annotations

import json
import shutil
import subprocess

import pytest

from graphsynth.workbench.modules import script
from graphsynth.workbench.writing import languages, page_file, write_workbench

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
)  # fmt: skip
#: Scripts that need no page: functions of drawings, files, addresses.
PURE = [name for line in page_file("order.txt").splitlines()[:2] for name in line.split()]


@pytest.fixture(scope="session")
def scripts():
    """Run JavaScript after the pure scripts in Node; what it returns comes back as Python values."""
    node = shutil.which("node")
    if not node:
        pytest.skip("no Node on this machine")
    words = "".join(f"Bench.words({json.dumps(k)}, {json.dumps(table)});" for k, table in languages().items())
    base = "".join(page_file(f"{name}.js") for name in PURE) + words + script("chains")

    def run(body, *arguments, modules=()):
        asked = f"(async (...args) => {{ {body} }})(...{json.dumps(arguments)})"
        end = "then(found => process.stdout.write(JSON.stringify({ found })))"
        text = f"{base}\n{''.join(map(script, modules))}{asked}.{end};"
        done = subprocess.run([node, "-"], input=text, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode == 0, done.stderr[-2000:]
        return json.loads(done.stdout).get("found")

    return run


def started(downloads):
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
    found.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(downloads)})
    return found


@pytest.fixture(scope="session")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="session")
def bench(tmp_path_factory):
    """The page as a folder."""
    return write_workbench(tmp_path_factory.mktemp("pages") / "bench")


@pytest.fixture(scope="session")
def window(downloads):
    """One window for all tests of the session."""
    found = started(downloads)
    yield found
    found.quit()
