"""What must hold of the repository itself: pins, imports, sizes."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
import yaml
from packaging.requirements import Requirement

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10, where pytest brings tomli
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent

# each module may import those before it
ORDER = [
    "errors", "files", "o3d", "engine", "untrusted", "meshes", "poses", "cameras", "sdf", "kernels", "kernels_surface",
    "kernels_silhouettes",
    "containers", "forces", "outlines", "silhouettes", "losses", "contact", "scene", "problem", "checkpoint", "arrange",
    "budget",
    "certify", "density", "packing", "voxels", "baselines", "mending", "pressing", "rasp", "dense",
    "kernels_stiffness", "kernels_relaxing", "relaxing", "moves", "smallest", "jobs",
    "removal", "physics", "pictures", "hulls", "matching", "kernels_docking", "docking", "jigsaw", "assembly",
    "accuracy", "profiles", "kernels_covering", "covering", "veiling", "lettering", "anamorphic", "atlas", "painting",
    "starts",
    "ablation", "sweep", "live", "palette", "show", "glb", "results",
    "provenance", "notebooks", "figures", "prose", "gallery", "widgets", "commands", "__main__",
]  # fmt: skip


def locked() -> dict[str, str]:
    """Package -> version in the lock, for Python 3.11 on Linux."""
    pins = {}
    for line in (ROOT / "requirements.lock").read_text().splitlines():
        requirement = Requirement(line)
        environment = {"python_version": "3.11", "python_full_version": "3.11.7", "sys_platform": "linux"}
        if requirement.marker is None or requirement.marker.evaluate(environment):
            (pin,) = requirement.specifier
            assert pin.operator == "=="
            pins[requirement.name.lower()] = pin.version
    return pins


def declared() -> list[Requirement]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return [Requirement(text) for text in project["dependencies"] + project["optional-dependencies"]["dev"]]


def test_everything_declared_is_locked():
    pins = locked()
    for requirement in declared():
        assert requirement.name in pins
        assert pins[requirement.name] in requirement.specifier


def test_environment_yml_pins_what_the_lock_pins():
    environment = yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]
    (pip,) = (entry["pip"] for entry in environment if isinstance(entry, dict))
    pins = locked()
    found = {r.name: str(r.specifier) for r in map(Requirement, pip)}
    assert found == {r.name: f"=={pins[r.name]}" for r in declared()}
    assert "python=3.11" in environment


def test_every_dependency_says_why_it_is_there():
    text = (ROOT / "pyproject.toml").read_text()
    for requirement in declared():
        assert re.search(rf'^    "{requirement.name}[^"]*", +# \w', text, re.M), requirement.name


def test_imports_go_one_way():
    modules = {path.stem: path for path in (ROOT / "rasp_core").glob("*.py") if path.stem != "__init__"}
    assert set(ORDER) == set(modules)
    for name, path in modules.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level == 1:
                used = [node.module] if node.module else [alias.name for alias in node.names]
                for module in (u for u in used if u in modules):
                    lazily = node.col_offset > 0
                    assert lazily or ORDER.index(module) < ORDER.index(name), f"{name} imports {module}"
            if isinstance(node, ast.Import | ast.ImportFrom):
                assert not (getattr(node, "module", "") or "").startswith(("notebooks", "tests", "data_fetch"))


def test_data_fetch_imports_nothing_of_the_loop():
    for path in (ROOT / "data_fetch").glob("*.py"):
        used = re.findall(r"from rasp_core\.(\w+)", path.read_text())
        assert set(used) <= {"errors", "meshes"}, path.name


def test_importing_the_core_loads_nothing_heavy():
    heavy = ["coacd", "dask", "distributed", "ipywidgets", "mujoco", "numba", "open3d", "pyvista"]
    code = f"import sys, rasp_core.jobs; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_only_widgets_imports_ipywidgets():
    users = [path.stem for path in (ROOT / "rasp_core").glob("*.py") if "import ipywidgets" in path.read_text()]
    assert users == ["widgets"]


@pytest.mark.parametrize("folder", ["rasp_core", "data_fetch", "tests"])
def test_files_are_short_enough_to_read_in_one_sitting(folder):
    for path in (ROOT / folder).glob("*.py"):
        assert len(path.read_text().splitlines()) <= 330, path.name


def test_system_libraries_are_found_or_named(monkeypatch, capsys):
    sys.path.insert(0, str(ROOT / "tools"))
    import system_libraries

    monkeypatch.setattr(system_libraries.sys, "platform", "linux")
    monkeypatch.setattr(system_libraries, "missing", lambda: {"libgl1": "open3d and vtk"})
    monkeypatch.setattr(system_libraries.os, "geteuid", lambda: 1000)
    monkeypatch.setattr(system_libraries.shutil, "which", lambda _: "/usr/bin/apt-get")
    assert system_libraries.main() == 1
    assert "sudo apt-get install -y --no-install-recommends libgl1" in capsys.readouterr().err
    monkeypatch.setattr(system_libraries.shutil, "which", lambda _: None)
    assert system_libraries.main() == 1
    assert "by their Debian names" in capsys.readouterr().err
    monkeypatch.setattr(system_libraries, "missing", dict)
    assert system_libraries.main() == 0


def test_missing_libraries_are_noticed(monkeypatch):
    sys.path.insert(0, str(ROOT / "tools"))
    import system_libraries

    monkeypatch.setitem(system_libraries.NEEDED, "libnot-there.so.9", ("libnot-there", "nobody"))
    assert system_libraries.missing() == {"libnot-there": "nobody"}


def test_binder_and_docker_install_the_libraries_that_make_does():
    sys.path.insert(0, str(ROOT / "tools"))
    from system_libraries import NEEDED

    assert (ROOT / "apt.txt").read_text().split() == sorted(package for package, _ in NEEDED.values())
    steps = (ROOT / "Dockerfile").read_text()
    assert "$(cat apt.txt)" in steps
    assert "RUN make setup" in steps


def test_colab_installs_all_but_what_it_brings():
    lines = (ROOT / "requirements-colab.txt").read_text().splitlines()
    named = [line for line in lines if line and not line.startswith("#")]
    brought = {"torch", "numpy", "scipy", "matplotlib", "contourpy", "tqdm", "scikit-image", "ipywidgets", "ipykernel"}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = {Requirement(text).name for text in project["dependencies"]} - brought
    pins = locked()
    assert {Requirement(line).name: str(Requirement(line).specifier)[2:] for line in named} == {
        name: pins[name.lower()] for name in wanted
    }


def test_notebooks_store_their_figures_as_pictures():
    for path in (ROOT / "notebooks").rglob("*.ipynb"):
        for cell in nbformat.read(path, as_version=4).cells:
            for output in cell.get("outputs", []):
                data = output.get("data", {})
                bare = re.match(r"<(Figure|matplotlib)", data.get("text/plain", "")) and not data.keys() & {"image/png"}
                assert not bare, f"{path.name}: a figure is stored in words, {data['text/plain']}"


KB = 1000  # bytes


@pytest.mark.parametrize("path", sorted((ROOT / "notebooks").rglob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks_are_small(path):
    assert path.stat().st_size <= 600 * KB


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="an export, in which nothing says what is stored")
def test_stored_figures_are_small_and_without_pdfs():
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "paper_figures"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    paths = [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).exists()]
    assert paths
    assert sum(path.stat().st_size for path in paths) <= 8000 * KB
    assert not [path.name for path in paths if path.suffix == ".pdf"]


def test_notebooks_run_by_hand_leave_the_stored_figures_alone():
    for path in (ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"):
        cells = nbformat.read(path, as_version=4).cells
        (parameters,) = (cell.source for cell in cells if "parameters" in cell.metadata.get("tags", []))
        assert 'out = "../out/figures/quick"' in parameters, path.name
        assert not any("paper_figures" in cell.source for cell in cells if cell.cell_type == "code"), path.name


def test_ci_makes_figures_and_looks_whether_the_checkout_has_changed():
    steps = (ROOT / ".ci" / "run").read_text()
    assert "set -euo pipefail" in steps
    assert steps.index("make figures NAMES=") < steps.index("make test") < steps.index("git status --porcelain")
