"""The scripts of the workbench in Node, and its page in a real Chromium."""

from __future__ import annotations

import json
import shutil
import subprocess

import pytest

from graphsynth.workbench.modules import script
from graphsynth.workbench.writing import languages, page_file, write_workbench
from tests.chromium import started
from tests.workbench.person import Person

#: Scripts that need no page: functions of drawings, files, addresses.
PURE = [name for line in page_file("order.txt").splitlines()[:2] for name in line.split()]


@pytest.fixture(scope="session")
def scripts():
    """Run JavaScript after the pure scripts in Node; what it returns comes back as Python values."""
    node = shutil.which("node")
    if not node:
        pytest.skip("no Node on this machine")
    words = "".join(f"Bench.words({json.dumps(k)}, {json.dumps(table)});" for k, table in languages().items())
    base = "".join(page_file(f"{name}.js") for name in PURE) + words + script("labels")

    def run(body, *arguments, modules=()):
        asked = f"(async (...args) => {{ {body} }})(...{json.dumps(arguments)})"
        end = "then(found => process.stdout.write(JSON.stringify({ found })))"
        text = f"{base}\n{''.join(map(script, modules))}{asked}.{end};"
        done = subprocess.run([node, "-"], input=text, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode == 0, done.stderr[-2000:]
        return json.loads(done.stdout).get("found")

    return run


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


@pytest.fixture
def person(window, bench):
    """Someone at the page, of which the console has nothing to complain afterwards."""
    window.get_log("browser")
    someone = Person(window, bench).open()
    yield someone
    assert not someone.complaints()
