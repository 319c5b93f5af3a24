"""The quickstart in a real browser: JupyterLab on localhost, headless Chromium, the panel driven by the mouse."""

import json
import os
import secrets
import shutil
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import chromium
import pytest

ROOT = Path(__file__).parent.parent
WINDOWING = "@jupyterlab/notebook-extension/tracker.jupyterlab-settings"

pytestmark = chromium.NEEDED


@pytest.fixture
def lab(tmp_path):
    """JupyterLab on a copy of the quickstart; yields the notebook's address."""
    (tmp_path / "work" / "notebooks").mkdir(parents=True)
    shutil.copy(ROOT / "notebooks" / "00_quickstart.ipynb", tmp_path / "work" / "notebooks")
    settings = tmp_path / "settings" / WINDOWING
    settings.parent.mkdir(parents=True)
    settings.write_text(json.dumps({"windowingMode": "none"}))  # all cells are on the page, not those in sight alone
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    token = secrets.token_hex(16)
    command = [sys.executable, "-m", "jupyterlab", "--no-browser", "--ip=127.0.0.1", f"--port={port}", "--allow-root"]
    command += [f"--ServerApp.root_dir={tmp_path / 'work'}", f"--LabApp.user_settings_dir={tmp_path / 'settings'}"]
    command += [f"--IdentityProvider.token={token}"]
    private = {f"JUPYTER_{name}_DIR": str(tmp_path / name) for name in ("CONFIG", "RUNTIME", "DATA")}
    private["JUPYTER_CONFIG_PATH"] = str(ROOT / "tools" / "jupyter")  # as `make lab` has it
    with open(tmp_path / "log", "w") as log:
        server = subprocess.Popen(command, env={**os.environ, **private}, stdout=log, stderr=log)
    try:
        _wait_for(f"http://127.0.0.1:{port}/api?token={token}", server, tmp_path / "log")
        yield f"http://127.0.0.1:{port}/lab/tree/notebooks/00_quickstart.ipynb?token={token}"
    finally:
        server.terminate()
        server.wait(30)


def _wait_for(address, server, log):
    for _ in range(300):
        try:
            return urllib.request.urlopen(address, timeout=5)
        except (urllib.error.URLError, ConnectionError):
            assert server.poll() is None, log.read_text()
            time.sleep(0.2)
    raise AssertionError(log.read_text())


def test_run_all_drag_lambda_press_run(lab, page):
    page.goto(lab)
    page.locator(".jp-Notebook .jp-Cell").first.wait_for(timeout=60_000)
    page.get_by_text("(ipykernel) | Idle").wait_for(timeout=60_000)
    page.get_by_role("menuitem", name="Run", exact=True).click()
    page.get_by_role("menuitem", name="Run All Cells", exact=True).click()
    said = page.locator(".jp-OutputArea-output", has_text="voxels agree with meshes within 1 %")
    page.wait_for_function("document.querySelectorAll('.jupyter-widgets .noUi-handle').length > 0", timeout=240_000)
    said.last.wait_for(timeout=240_000)
    drawn = "!!document.querySelector('.rasp-recording')?.recording?.silhouette"  # with three.js, of the kernel
    page.wait_for_function(drawn, timeout=60_000)

    panel = page.locator(".jp-OutputArea .widget-vbox").first
    panel.scroll_into_view_if_needed()
    label, image = panel.locator(".widget-label", has_text="iteration"), panel.locator("img")
    run, pause = (panel.get_by_role("button", name=name, exact=True) for name in ("Run", "Pause"))
    slider = panel.locator(".widget-hslider", has_text="lambda")

    def shown():
        return label.inner_text(), image.get_attribute("src")

    def changes(before):
        """Wait until both the numbers and the picture are others."""
        for _ in range(100):
            page.wait_for_timeout(100)
            now = shown()
            if now[0] != before[0] and now[1] != before[1]:
                return now
        raise AssertionError(f"nothing but {before}")

    start = shown()
    assert start[0].startswith("iteration 0:")
    run.click()
    first = changes(start)
    before, handle = slider.locator(".widget-readout").inner_text(), slider.locator(".noUi-handle").bounding_box()
    x, y = handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 60, y, steps=5)
    page.mouse.up()
    assert float(slider.locator(".widget-readout").inner_text()) > 10 * float(before)
    changes(first)
    pause.click()
    page.wait_for_timeout(500)
    rested = shown()
    page.wait_for_timeout(500)
    assert shown() == rested
    assert "exact booleans" not in rested[0], "it had come to its end, the slider was not moved while it ran"

    assert page.problems == []
    assert page.locator("[data-mime-type='application/vnd.jupyter.error']").count() == 0
    assert page.locator("[data-mime-type='application/vnd.jupyter.stderr']").count() == 0
