"""A real browser for the tests of the pages."""

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
WIDE, NARROW = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
HUGE = {"width": 1920, "height": 1080}


@dataclass
class Watched:
    """A page that is open, and all that it did which it should not."""

    page: object
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def check(self) -> None:
        """Fail on any console message, error, or request beyond the file itself."""
        assert self.complaints == []
        outside = [
            url for url in self.requests if not url.startswith(("file:", "data:"))
        ]
        assert outside == []


@pytest.fixture(scope="session")
def chromium() -> Iterator[object]:
    """Start Chromium; a machine without one skips, unless it must have one."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        words = f"none of {', '.join(BROWSERS)} is installed"
        if os.environ.get("REARVIEW_NEEDS_BROWSER"):
            pytest.fail(words)
        pytest.skip(words)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture
def show(chromium):
    """Open a file as a page; at the end it must have behaved."""
    opened = []

    def open_file(file: Path, size=None, scheme="light") -> Watched:
        context = chromium.new_context(viewport=size or WIDE, color_scheme=scheme)
        page = context.new_page()
        watched = Watched(page)
        opened.append((context, watched))
        page.on("console", lambda message: watched.complaints.append(message.text))
        page.on("pageerror", lambda error: watched.complaints.append(str(error)))
        page.on("request", lambda request: watched.requests.append(request.url))
        page.goto(file.resolve().as_uri())
        return watched

    yield open_file
    for context, watched in opened:
        context.close()
        watched.check()
