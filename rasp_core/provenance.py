"""What a figure was made from: digests of its notebook, the code that it reaches, the data's registry, the lock.

A facts file keeps them, so that a figure that is older than what it depends on can be told. Comments, docstrings,
layout, and modules that a notebook does not reach change nothing.
"""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

PACKAGES = ("rasp_core", "data_fetch")


def sources(notebook: Path, root: Path) -> dict[str, str]:
    """Digests `notebook`, `core` (modules of the kit that its code imports, and what these import), `registry`, `lock`.

    notebook : an .ipynb; only the code in it counts. root : of the repository. Raises OSError where one of the files
    is not there.
    """
    cells = [c for c in json.loads(notebook.read_text())["cells"] if c["cell_type"] == "code"]
    # papermill adds a cell of its own, with the parameters of one run
    code = ["".join(c["source"]) for c in cells if "injected-parameters" not in c["metadata"].get("tags", [])]
    lines = "\n".join(code).splitlines()
    reached = modules("\n".join(line for line in lines if not line.startswith("%")), root)
    return {
        "notebook": _digest("\n\n".join(code)),
        "core": _digest("\n".join(f"{path.relative_to(root)} {_bare(path.read_text())}" for path in reached)),
        "registry": _digest((root / "data_fetch" / "registry.csv").read_text()),
        "lock": _digest((root / "requirements.lock").read_text()),
    }


def modules(code: str, root: Path) -> list[Path]:
    """The files of the kit that some code imports, and those that they import, sorted."""
    found: set[Path] = set()
    waiting = list(_imported(code, None, root))
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _imported(path.read_text(), path, root)
    return sorted(found)


def _imported(code: str, path: Path | None, root: Path) -> Iterator[Path]:
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            package = path.parent.name if node.level and path else ""
            module = ".".join(part for part in (package, node.module) if part)
            names = [module, *(f"{module}.{alias.name}" for alias in node.names)]
        else:
            continue
        for name in names:
            if name.split(".")[0] in PACKAGES:
                place = root.joinpath(*name.split("."))
                yield from (p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file())


def _bare(code: str) -> str:
    """The syntax tree in words, without docstrings."""
    tree = ast.parse(code)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            value = body[0].value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                del body[0]
    return ast.dump(tree)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
