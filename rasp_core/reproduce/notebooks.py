"""A notebook is run in a process of its own, with progress; standard error says nothing that is not the kit's."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
import papermill
from jupyter_client import AsyncKernelManager
from nbclient.exceptions import DeadKernelError
from traitlets.config import Config

from ..visualize.recording_page import WIDGET

UNSTORED = "unstored"  # the tag of a cell whose output is not kept in the repository
STATES = "application/vnd.jupyter.widget-state+json"


class Kernel(AsyncKernelManager):
    """A notebook's process. It is asked to end; the interrupt that usually comes first would be an error in its log
    where it is still busy with its last answer."""

    async def shutdown_kernel(self, now: bool = False, restart: bool = False) -> None:
        self.shutting_down = True
        self.stop_restarter()
        await self.request_shutdown(restart)
        await self.finish_shutdown(restart=restart)
        await self.cleanup_resources(restart)


def run(path: Path, target: Path, parameters: dict) -> str | None:
    """Run a notebook in its folder and write it with its outputs to `target`; None, or in one line how it failed."""
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f".{target.name}.part.ipynb")
    bar = {"desc": path.stem, "leave": False} if sys.stderr.isatty() else False
    try:
        with TemporaryDirectory(prefix="rasp") as folder:
            papermill.execute_notebook(
                str(path),
                str(part),
                parameters,
                cwd=str(path.parent),
                progress_bar=bar,
                autosave_cell_every=0,
                kernel_name="python3",
                language="python",
                kernel_manager_class=Kernel,
                config=_sockets(folder),
            )
    except papermill.exceptions.PapermillExecutionError as error:
        os.replace(part, target)
        return f"failed in cell {error.exec_count}: {error.ename}: {' '.join(str(error.evalue).split())[:200]}"
    except DeadKernelError:
        part.unlink(missing_ok=True)
        return "failed: its Python process died"
    _forget_places(part)
    os.replace(part, target)
    return None


def store(source: Path, target: Path) -> None:
    """Write a notebook that was run to `target`, without the outputs of cells with the tag `UNSTORED`, and without
    widgets beside which there is HTML: that shows as much where nothing runs, and holds the same data."""
    notebook = nbformat.read(source, as_version=4)
    states = notebook.metadata.get("widgets", {}).get(STATES, {}).get("state", {})
    for cell in notebook.cells:
        if UNSTORED in cell.metadata.get("tags", []):
            cell.outputs = []
        for data in (output.get("data", {}) for output in cell.get("outputs", [])):
            if "text/html" in data and WIDGET in data:
                states.pop(data.pop(WIDGET)["model_id"], None)
    nbformat.write(notebook, target)


def _sockets(folder: str) -> Config:
    """Sockets in a folder that is the user's alone, where there are such: over TCP everybody on the machine could
    listen, and the kernel warns of it."""
    if os.name != "posix":
        return Config()
    return Config({"KernelManager": {"transport": "ipc", "ip": str(Path(folder) / "kernel")}})


def _forget_places(path: Path) -> None:
    """Take papermill's notes of folders and times out of a notebook: a run elsewhere stores the same."""
    notebook = nbformat.read(path, as_version=4)
    for part in (notebook, *notebook.cells):
        part.metadata.pop("papermill", None)
    nbformat.write(notebook, path)
