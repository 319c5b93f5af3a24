"""Build the site of notebooks, gallery, exercises and API reference: pages that work without a kernel and offline.

python tools/build_site.py FOLDER
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STYLE = re.compile(r"<style[^>]*>(.*?)</style>", re.S)
LINE = re.compile(r'<span id="[^"]*"><a href="[^"]*"><span class="linenos">[^<]*</span></a>(.*?)\n</span>', re.S)


def build(out: Path) -> None:
    """Write the site to the folder `out`, which is replaced. Raises SystemExit with a line if a part fails."""
    from sphinx.cmd.build import build_main

    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".site", dir=out.parent) as part:
        html, doctrees = Path(part) / "html", Path(part) / "doctrees"
        with start_api(html / "api") as api:
            options = ["--quiet", "--fail-on-warning", "--keep-going", "--conf-dir", str(ROOT / "docs")]
            failed = build_main(["--builder", "html", *options, "--doctree-dir", str(doctrees), str(ROOT), str(html)])
        if failed or api.returncode:
            raise SystemExit("the site was not built; mend what Sphinx or pdoc says above")
        shutil.copy(html / "README.html", html / "index.html")
        write_scenes(html / "scenes")
        slim(html / "api")
        for path in (html / "_static").rglob("*.map"):  # for those who debug the theme's scripts
            path.unlink()
        shutil.rmtree(out, ignore_errors=True)
        html.rename(out)


def start_api(folder: Path) -> subprocess.Popen:
    """pdoc at work on every module, beside Sphinx; by packages alone it would leave out what the door does not name."""
    modules = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for package in ("rasp_core", "data_fetch")
        for pattern in ("*.py", "*/__init__.py")  # a room brings its modules
        for path in sorted((ROOT / package).glob(pattern))
        if path.stem != "__main__"
    ]
    quiet = ["-W", "ignore:Error parsing type annotation"]  # of names that only type checkers import
    options = ["--template-directory", str(ROOT / "docs" / "pdoc"), "--output-directory", str(folder)]
    return subprocess.Popen([sys.executable, *quiet, "-m", "pdoc", *options, *modules], cwd=ROOT)


def slim(folder: Path) -> None:
    """Put the styles that each of pdoc's pages holds, all the same, into one file beside them, and leave out the link
    on each line of code, a fifth of all pages."""
    pages = sorted(folder.rglob("*.html"))
    shared = STYLE.findall(pages[0].read_text(encoding="utf-8"))
    (folder / "style.css").write_text("\n".join(shared), encoding="utf-8")
    for page in pages:
        text = LINE.sub(r"\1\n", page.read_text(encoding="utf-8"))
        head, *rest = STYLE.split(text)
        if rest[::2] == shared:  # a page of another kind keeps its own
            there = Path(os.path.relpath(folder / "style.css", page.parent)).as_posix()
            text = f'{head}<link rel="stylesheet" href="{there}">{"".join(rest[1::2])}'
        page.write_text(text, encoding="utf-8")


def write_scenes(folder: Path) -> None:
    """Write a page for each of the gallery's scenes."""
    from rasp_core.visualize.gltf import page_of

    folder.mkdir()
    for path in sorted((ROOT / "paper_figures").glob("*.glb")):
        (folder / f"{path.stem}.html").write_text(page_of(path.read_bytes()), encoding="utf-8")


if __name__ == "__main__":
    build(Path(sys.argv[1]).absolute())
