"""What must hold of the repository itself: pins, imports, sizes."""

import ast
import graphlib
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
import trimesh
import yaml
from packaging.requirements import Requirement

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10, where pytest brings tomli
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent

# a room may import from itself and from those before it; "" is the top level, the paper
ROOMS = (
    *("util", "io", "geometry", "kernels", "", "exact", "packing", "physics", "assembly", "art", "visualize", "api"),
    *("reproduce", "cli"),
)


def locked(name: str = "requirements.lock") -> dict[str, str]:
    """Package -> version in the lock, for Python 3.11 on Linux."""
    pins = {}
    for line in (ROOT / name).read_text().splitlines():
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


def declared_for_the_site() -> list[Requirement]:
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["dependency-groups"]
    return [Requirement(text) for text in groups["site"]]


def test_everything_declared_is_locked():
    pins = locked()
    for requirement in declared():
        assert requirement.name in pins
        assert pins[requirement.name] in requirement.specifier


def test_the_site_is_built_with_packages_that_the_lock_allows():
    pins, site = locked(), locked("docs/requirements.txt")
    assert {requirement.name for requirement in declared_for_the_site()} <= site.keys()
    shared = site.keys() & pins.keys()
    assert len(shared) > 20
    assert {name: site[name] for name in shared} == {name: pins[name] for name in shared}


def test_environment_yml_pins_what_the_lock_pins():
    environment = yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]
    (pip,) = (entry["pip"] for entry in environment if isinstance(entry, dict))
    pins = locked()
    found = {r.name: str(r.specifier) for r in map(Requirement, pip)}
    assert found == {r.name: f"=={pins[r.name]}" for r in declared()}
    assert "python=3.11" in environment


def test_every_dependency_says_why_it_is_there():
    text = (ROOT / "pyproject.toml").read_text()
    for requirement in declared() + declared_for_the_site():
        assert re.search(rf'^    "{requirement.name}[^"]*", +# \w', text, re.M), requirement.name


def imports(package: Path) -> list[tuple[str, str]]:
    """Pairs (importing file, imported file) in a package, by their paths in it; imports inside functions too."""
    pairs = []
    for path in sorted(package.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level:
                base = path.relative_to(package.parent).parts[: -node.level]
                base = package.parent.joinpath(*base, *(node.module or "").split("."))
            elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == package.name:
                base = package.parent.joinpath(*node.module.split("."))
            else:
                continue
            for alias in node.names:
                for place in (base / f"{alias.name}.py", base.with_suffix(".py")):
                    if place.is_file():
                        pairs.append((str(path.relative_to(package)), str(place.relative_to(package))))
                        break
    return pairs


def upward(package: Path) -> list[str]:
    """The imports from a room of one above it."""
    floor = {room: number for number, room in enumerate(ROOMS)}
    pairs = (tuple(path.rpartition("/")[0] for path in pair) for pair in imports(package))
    above = zip(imports(package), pairs, strict=True)
    return [f"{a} imports {b}" for (a, b), (low, high) in above if a != "__main__.py" and floor[high] > floor[low]]


def test_imports_between_rooms_go_one_way():
    package = ROOT / "rasp_core"
    assert {path.parent.name for path in package.glob("*/__init__.py")} == set(ROOMS) - {""}
    assert len(imports(package)) > 200
    assert upward(package) == []


@pytest.mark.parametrize(
    "line",
    [
        "from ..packing import dense",
        "from rasp_core.packing import dense",
        "def f():\n    from ..packing.dense import pack",
        "if True:\n    from .. import losses",
    ],
)
def test_an_import_of_a_room_above_is_noticed(tmp_path, line):
    for name in ("__init__", "losses", "geometry/__init__", "geometry/sdf", "packing/__init__", "packing/dense"):
        path = tmp_path / "rasp_core" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    assert upward(tmp_path / "rasp_core") == []
    (tmp_path / "rasp_core" / "geometry" / "sdf.py").write_text(f"{line}\n")
    assert len(upward(tmp_path / "rasp_core")) == 1


def test_no_two_files_import_each_other():
    graph: dict[str, set[str]] = {}
    for user, used in imports(ROOT / "rasp_core"):
        graph.setdefault(user, set()).add(used)
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError with the cycle


def test_the_core_imports_nothing_of_what_uses_it():
    for path in (ROOT / "rasp_core").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert (node.module or "").split(".")[0] not in ("notebooks", "tests", "data_fetch"), path


def test_tests_mirror_the_rooms():
    for path in (ROOT / "tests").glob("*/test_*.py"):
        room, name = path.parent.name, path.stem.removeprefix("test_")
        if room in ROOMS:
            assert (ROOT / "rasp_core" / room / f"{name}.py").is_file(), path
    for path in (ROOT / "rasp_core").rglob("*.py"):
        if path.stem not in ("__init__", "__main__"):
            assert (ROOT / "tests" / path.parent.relative_to(ROOT / "rasp_core") / f"test_{path.stem}.py").is_file()


def test_rooms_have_nothing_in_their_init():
    assert all(not path.read_text() for path in (ROOT / "rasp_core").glob("*/__init__.py"))


def test_the_top_level_is_the_paper():
    files = list((ROOT / "rasp_core").glob("*.py"))
    assert len(files) <= 12
    assert sum(len(path.read_text().splitlines()) for path in files) <= 2000
    for number in range(1, 7):
        assert any(f"Eq. {number}" in path.read_text() for path in files), number


def test_data_fetch_imports_nothing_of_the_loop():
    for path in (ROOT / "data_fetch").glob("*.py"):
        used = re.findall(r"from rasp_core\.(\w+)", path.read_text())
        assert set(used) <= {"util", "geometry"}, path.name


def test_importing_the_core_loads_nothing_heavy():
    heavy = ["dask", "distributed", "ipywidgets", "mujoco", "numba", "open3d", "pyvista"]
    code = f"import sys, rasp_core.packing.methods; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_packing_one_part_loads_no_more_than_it_needs(tmp_path):
    """Torch, numba, open3d and matplotlib's figure are needed; each of these takes from a tenth to three seconds."""
    trimesh.creation.box((0.05, 0.05, 0.05)).export(tmp_path / "one.stl")
    pack = ["pack", str(tmp_path / "one.stl"), "--container", "box:0.1,0.1,0.1", "--iterations", "10"]
    pack += ["--out", str(tmp_path / "out")]
    heavy = ["IPython", "dash", "dask", "distributed", "flask", "ipywidgets", "matplotlib.pyplot", "mujoco"]
    heavy += ["papermill", "pydantic", "pyvista", "sympy", "torch._dynamo", "torch._inductor", "vtkmodules"]
    code = f"import sys; from rasp_core.cli.main import main; status = main({pack})\n"
    code += f"print([m for m in {heavy} if m in sys.modules], status)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[] 0"


def test_only_widgets_imports_ipywidgets():
    users = [path.stem for path in (ROOT / "rasp_core").rglob("*.py") if "import ipywidgets" in path.read_text()]
    assert users == ["panel"]


@pytest.mark.parametrize("folder", ["rasp_core", "data_fetch", "tests"])
def test_files_are_short_enough_to_read_in_one_sitting(folder):
    for path in (ROOT / folder).rglob("*.py"):
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
    notebooks = ROOT / "notebooks"
    for path in [notebooks / "from_scratch.ipynb", *notebooks.glob("[0-9][0-9]_*.ipynb")]:
        cells = nbformat.read(path, as_version=4).cells
        (parameters,) = (cell.source for cell in cells if "parameters" in cell.metadata.get("tags", []))
        assert 'out = "../out/figures/quick"' in parameters, path.name
        assert not any("paper_figures" in cell.source for cell in cells if cell.cell_type == "code"), path.name


def test_ci_makes_figures_and_looks_whether_the_checkout_has_changed():
    steps = (ROOT / ".ci" / "run").read_text()
    assert "set -euo pipefail" in steps
    assert steps.index("make figures NAMES=") < steps.index("make test") < steps.index("git status --porcelain")
