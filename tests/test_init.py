"""The door: every name is there when it is asked for, has an example that runs, and nothing heavy is loaded before."""

import ast
import doctest
import subprocess
import sys
from pathlib import Path

import pytest

import rasp_core as rasp

STUB = Path(rasp.__file__).with_suffix(".pyi")
NAMES = [
    alias.asname
    for node in ast.walk(ast.parse(STUB.read_text()))
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
]


def test_the_door_is_what_the_readme_names():
    assert {"load", "box", "pack", "assemble", "sculpt", "optimize", "panel"} <= set(NAMES)
    assert sorted(NAMES) == sorted(rasp.__all__)
    assert all(callable(getattr(rasp, name)) for name in NAMES)


def test_a_name_that_is_not_there_is_named():
    with pytest.raises(AttributeError, match="sqeeze"):
        _ = rasp.sqeeze


def test_the_loops_module_does_not_hide_the_doors_name():
    code = "import rasp_core.api.optimize, rasp_core as rasp; print(callable(rasp.optimize))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


def test_importing_the_door_loads_nothing_heavy():
    heavy = ["numpy", "torch", "open3d", "pyvista", "numba", "matplotlib", "trimesh", "scipy"]
    code = f"import sys, rasp_core; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", sorted(set(NAMES) - {"InputError"}))
def test_each_name_has_an_example_that_runs(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = doctest.DocTestFinder(recurse=False).find(getattr(rasp, name), name)
    assert found[0].examples, name
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    said: list[str] = []
    for test in found:
        runner.run(test, out=said.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(said)
