"""Headless Chromium for the tests, where there is one."""

import shutil
from contextlib import contextmanager

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NEEDED = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here; Debian: apt-get install chromium"),
]


@contextmanager
def pages():
    """Yields a function that opens a page; `page.problems` gathers what the page's scripts throw."""
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        quiet = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"]
        quiet += ["--disable-component-update", "--disable-sync", "--disable-gpu", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=quiet)

        def new_page():
            page = browser.new_page(viewport={"width": 1400, "height": 1000})
            page.problems = []
            page.on("pageerror", lambda error: page.problems.append(str(error)))
            return page

        yield new_page
        browser.close()
