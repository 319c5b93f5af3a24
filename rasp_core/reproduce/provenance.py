"""What a figure was made from: digests of its notebook, the code that it reaches, the data's registry, the lock.

A facts file keeps them, so that a figure that is older than what it depends on can be told. Comments, docstrings,
layout, the place and name of a file, and modules that a notebook does not reach change nothing. The digests are the
same on every Python that the kit supports.
"""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

PACKAGES = ("rasp_core", "data_fetch")


def sources(notebook: Path, root: Path) -> dict[str, str]:
    """Digests `notebook`, `core` (modules of the kit that its code imports, and what these import), `registry`, `lock`.

    notebook : an .ipynb; only the code in it counts. root : of the repository. Raises OSError if one of the files
    is not there.
    """
    cells = [c for c in json.loads(notebook.read_text(encoding="utf-8"))["cells"] if c["cell_type"] == "code"]
    # papermill adds a cell of its own, with the parameters of one run
    code = ["".join(c["source"]) for c in cells if "injected-parameters" not in c["metadata"].get("tags", [])]
    lines = "\n".join(code).splitlines()
    code = "\n".join(line for line in lines if not line.startswith("%"))
    reached = (_meaning(path.read_text(encoding="utf-8"), path, root) for path in modules(code, root))
    return {
        "notebook": _digest(_meaning(code, None, root)),
        "core": _digest("\n".join(sorted(filter(None, reached)))),
        "registry": _digest((root / "data_fetch" / "registry.csv").read_text(encoding="utf-8")),
        "lock": _digest((root / "requirements.lock").read_text(encoding="utf-8")),
    }


def modules(code: str, root: Path) -> list[Path]:
    """The files of the kit that some code imports, and those that they import, sorted."""
    found: set[Path] = set()
    waiting = [path for path, _ in _imported(_parsed(code), None, root).values()]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            tree = _parsed(path.read_text(encoding="utf-8"))
            waiting += [path for path, _ in _imported(tree, path, root).values()]
    return sorted(found)


def _imported(tree: ast.Module, path: Path | None, root: Path) -> dict[str, tuple[Path, str | None]]:
    """Local name -> the kit's file that it comes from, and the name there (None for the module itself).

    Of the door (`import rasp_core as rasp`) each name that is used is one, as `rasp.pack`.
    """
    found: dict[str, tuple[Path, str | None]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name in PACKAGES:
                    found |= _door_names(tree, alias.asname or alias.name, root / alias.name)
                elif (module := _file(alias.name, root)) is not None:
                    found[alias.asname or alias.name] = module, None
        elif isinstance(node, ast.ImportFrom):
            package = path.relative_to(root).parts[: -node.level] if node.level and path else ()
            module = ".".join([*package, *filter(None, [node.module])])
            for alias in node.names:
                local = alias.asname or alias.name
                if (inner := _file(f"{module}.{alias.name}", root)) is not None:
                    found[local] = inner, None
                elif module in PACKAGES and alias.name in (door := _door(root / module)):
                    found[local] = door[alias.name]
                elif (outer := _file(module, root)) is not None:
                    found[local] = outer, alias.name
    return found


def _file(name: str, root: Path) -> Path | None:
    """The file of a module of the kit, by its dotted name; None if it is not the kit's."""
    if name.split(".")[0] not in PACKAGES:
        return None
    place = root.joinpath(*name.split("."))
    return next((p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file()), None)


def _door(package: Path) -> Mapping[str, tuple[Path, str | None]]:
    """The names that a package loads when they are first used, by its stub."""
    stub = package / "__init__.pyi"
    if not stub.is_file():
        return {}
    return _imported(_parsed(stub.read_text(encoding="utf-8")), stub, package.parent)


def _door_names(tree: ast.Module, local: str, package: Path) -> dict[str, tuple[Path, str | None]]:
    door = _door(package)
    used = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == local
    }
    return {f"{local}.{name}": door[name] for name in sorted(used & door.keys())}


def _meaning(code: str, path: Path | None, root: Path) -> str:
    """The syntax tree in words; a name that is imported from the kit is what its file says, wherever that lies."""
    names = {
        local: f"{_digest(_in_words(file.read_text(encoding='utf-8')))} {name}"
        for local, (file, name) in _imported(_parsed(code), path, root).items()
    }
    return _in_words(code, tuple(sorted(names.items())))


@lru_cache(maxsize=4096)
def _in_words(code: str, names: tuple[tuple[str, str], ...] = ()) -> str:
    """Some code's syntax tree in words. names : what stands for names that are imported from the kit."""
    tree = _parsed(code)
    unknown = {
        alias.asname or alias.name: "kit"
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom) and _of_the_kit(node)
        for alias in node.names
    }
    return _words(tree, unknown | dict(names))


@lru_cache(maxsize=1024)
def _parsed(code: str) -> ast.Module:
    return ast.parse(code)


def _words(node, names: Mapping[str, str]) -> str:
    """A syntax tree in words, without docstrings, imports from the kit, and what is empty: Pythons differ in that."""
    if isinstance(node, list):
        return f"[{' '.join(filter(None, (_words(entry, names) for entry in node)))}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    if isinstance(node, ast.Import | ast.ImportFrom) and _of_the_kit(node):
        return ""
    if isinstance(node, ast.Name) and node.id in names:
        return f"({names[node.id]})"
    fields = "".join(f" {name}={_words(value, names)}" for name, value in _fields(node) if value not in (None, []))
    return f"({type(node).__name__}{fields})"


def _fields(node: ast.AST) -> Iterator[tuple[str, object]]:
    for name, value in ast.iter_fields(node):
        if name == "body" and isinstance(value, list) and value and _is_words_alone(value[0]):
            value = value[1:]
        if isinstance(node, ast.JoinedStr):
            value = _merged(value)
        yield name, value


def _merged(values: list[ast.expr]) -> list[ast.expr]:
    """The parts of an f-string with texts that are side by side as one: Python 3.12.1 leaves some apart."""
    merged: list[ast.expr] = []
    for value in values:
        if isinstance(value, ast.Constant) and merged and isinstance(merged[-1], ast.Constant):
            merged[-1] = ast.Constant(merged[-1].value + value.value)
        else:
            merged.append(value)
    return [value for value in merged if not (isinstance(value, ast.Constant) and value.value == "")]


def _is_words_alone(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _of_the_kit(node: ast.Import | ast.ImportFrom) -> bool:
    if isinstance(node, ast.ImportFrom) and node.level:
        return True
    named = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    return all(name.split(".")[0] in PACKAGES for name in named)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
