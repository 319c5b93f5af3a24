"""How Sphinx makes the site of the repository's own pages: notebooks as they are stored, and Markdown.

`tools/build_site.py` calls it. The pages are read where they lie, so links between them hold on GitHub and here.
"""

import ast
import importlib.util
import json
import re
from pathlib import Path

from docutils import nodes
from sphinx.addnodes import download_reference

from rasp_core.visualize import recording_page

ROOT = Path(__file__).resolve().parent.parent
MATHJAX = Path(importlib.util.find_spec("sphinx-mathjax-offline").submodule_search_locations[0]) / "static" / "mathjax"
WIDGET, THREE = recording_page.WIDGET, "three.js"
NO_KERNEL = "<p class='no-kernel'>Sliders and buttons are here when the notebook runs: <code>make lab</code>.</p>"

project = "The RASP kit"
language = "en"
extensions = ["myst_nb", "sphinx_copybutton"]
include_patterns = ["*.md", "docs/*.md", "notebooks/**", "paper_figures/README.md"]
exclude_patterns = [".*", "build", "out", "**/.ipynb_checkpoints", "rasp_core", "data_fetch", "tests", "tools"]
root_doc = "README"

nb_execution_mode = "off"
nb_code_prompt_show = nb_code_prompt_hide = "Folded cell"
nb_merge_streams = True
nb_output_stderr = "remove"  # warnings of the machine that ran them
myst_enable_extensions = ["amsmath", "dollarmath", "html_image"]
myst_heading_anchors = 4  # REPRODUCING.md#what-was-tried-and-not-kept, as GitHub has it
suppress_warnings = ["myst.header"]  # a level left out

mathjax_path = "tex-svg-full.js"  # all of TeX's extensions and glyphs in one file, which file:// can load
html_theme = "sphinx_book_theme"
html_title = project
html_static_path = ["_static", str(MATHJAX / mathjax_path)]
html_css_files = ["site.css"]
html_show_search_summary = False  # it fetches pages, which file:// does not allow
html_show_sphinx = False
html_context = {"default_mode": "light"}  # the pictures are white
html_theme_options = {
    "home_page_in_toc": True,
    "show_toc_level": 2,
    "navbar_persistent": [],
    "footer_content_items": [],
}


def setup(app):
    app.connect("builder-inited", _bundle)
    app.connect("source-read", _prepare)
    app.connect("doctree-read", _link_sources, priority=400)  # before Sphinx collects what is to be downloaded


def _prepare(app, name, source):
    if app.env.doc2path(name).suffix == ".ipynb":
        source[0] = json.dumps(_static(json.loads(source[0]), name))
    elif name == root_doc:
        source[0] += _toctrees()
    elif name == "paper_figures/README":
        text = source[0].replace("\n| figure", f"\n{_scenes()}\n## Each claim of the paper\n\n| figure", 1)
        source[0] = f"---\nhtml_theme.sidebar_secondary.remove: true\n---\n{text}"  # room for the table
    elif name == "docs/reference":
        source[0] += _modules()
    elif name == "docs/recorded":
        data = (ROOT / "docs" / "recorded_run.json").read_text(encoding="utf-8")
        source[0] = source[0].replace("RECORDED", f"````{{raw}} html\n{_three(name)}{recording_page.cell(data)}\n````")


def _bundle(app):
    """three.js as one file of the site."""
    path = Path(app.doctreedir) / THREE
    path.write_text(recording_page.three_js(), encoding="utf-8")
    app.config.html_static_path.append(str(path))


def _three(name: str) -> str:
    """What loads it before a recorded run on the page `name`."""
    return f'<script src="{"../" * name.count("/")}_static/{THREE}"></script>'


def _static(notebook: dict, name: str) -> dict:
    """A notebook without widgets, which are blank without a kernel; what JupyterLab folds is folded; recorded runs are
    drawn with three.js."""
    notebook["metadata"].pop("widgets", None)
    for cell in notebook["cells"]:
        if cell["metadata"].get("jupyter", {}).get("source_hidden"):
            cell["metadata"].setdefault("tags", []).append("hide-input")
        for output in cell.get("outputs", []):
            if output.get("data", {}).pop(WIDGET, None) is not None and set(output["data"]) <= {"text/plain"}:
                output["data"] = {"text/html": NO_KERNEL}
            html = "".join(output.get("data", {}).get("text/html", ""))
            if 'class="rasp-recording"' in html:
                output["data"]["text/html"] = _three(name) + html
    return notebook


def _toctrees() -> str:
    """The site's pages in the order of reading, for the sidebar."""
    groups = {
        "Notebooks": _in_order("notebooks", first="from_scratch"),
        "Exercises": _in_order("notebooks/exercises", first="README"),
        "Results": ["paper_figures/README", "docs/recorded", "REPRODUCING"],
        "The code": ["docs/reference", "CONTRIBUTING", "CHANGELOG"],
    }
    tree = "\n```{{toctree}}\n:hidden:\n:titlesonly:\n:caption: {}\n\n{}\n```\n"
    return "".join(tree.format(caption, "\n".join(pages)) for caption, pages in groups.items())


def _in_order(folder: str, first: str) -> list[str]:
    """The pages of a folder: `first`, then by number (10 after 9), then the others by name."""
    names = {path.stem for path in (ROOT / folder).iterdir() if path.suffix in (".ipynb", ".md")}
    numbers = {name: int(found[0]) for name in names if (found := re.match(r"\d+", name))}
    ordered = sorted(names, key=lambda name: (name != first, numbers.get(name, len(names)), name.lower()))
    return [f"{folder}/{name}" for name in ordered]


def _scenes() -> str:
    """The gallery's scenes as frames; `tools/build_site.py` writes their pages."""
    frames = "".join(
        f"<figure><iframe loading='lazy' src='../scenes/{path.stem}.html' title='{path.stem}'></iframe>"
        f"<figcaption><a href='../notebooks/{path.stem}.html'>{path.stem}</a></figcaption></figure>\n"
        for path in sorted((ROOT / "paper_figures").glob("*.glb"))
    )
    whole = "<p><code>make gallery</code> writes all of this as one file, <code>out/gallery.html</code>, to send.</p>"
    return f"## Turn them with the mouse\n\n<div class='scenes'>\n{frames}</div>\n{whole}\n"


def _modules() -> str:
    """A table of the modules by room, each with the first line of its docstring."""
    lines, room = [], None
    for package in ("rasp_core", "data_fetch"):
        for path in sorted((ROOT / package).rglob("*.py"), key=lambda path: (str(path.parent), path.name)):
            said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
            if not said or path.stem == "__main__":
                continue
            here = path.parent.relative_to(ROOT).as_posix()
            if here != room:
                lines += [f"\n## {here.replace('/', '.')}\n", "| module | what it is |", "|---|---|"]
                room = here
            first = said.split("\n\n")[0].replace("\n", " ").replace("|", r"\|")
            shown = here.replace("/", ".") if path.stem == "__init__" else path.stem
            lines.append(f"| [`{shown}`](../{path.relative_to(ROOT).as_posix()}) | {first} |")
    return "\n".join(lines) + "\n"


def _link_sources(app, doctree):
    """Links to the kit's source files lead to their pages in the API reference."""
    for node in list(doctree.findall(download_reference)):
        path = Path(app.env.relfn2path(node["reftarget"])[1]).relative_to(ROOT)
        if path.suffix == ".py" and path.parts[0] in ("rasp_core", "data_fetch"):
            page = path.parent if path.stem == "__init__" else path.with_suffix("")
            up = "../" * app.env.docname.count("/")
            module, _, name = node.astext().partition(".")  # losses.overlap: the function, not only its file
            anchor = f"#{name}" if module == page.name and name not in ("", "py") else ""
            link = nodes.reference("", "", refuri=f"{up}api/{page.as_posix()}.html{anchor}", internal=True)
            link += [part for label in node.children for part in label.children]  # without the label's arrow
            node.replace_self(link)
