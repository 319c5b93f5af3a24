"""The site, as `make site` builds it, opened from its folder in headless Chromium: nothing broken, nothing fetched."""

import importlib.util
import io
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit
from urllib.request import url2pathname

import chromium
import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parent.parent
TOOLS = ("sphinx", "myst_nb", "sphinx_book_theme", "sphinx_copybutton", "sphinx-mathjax-offline")

pytestmark = chromium.NEEDED

# what a page holds once its equations are set, its pictures there and its films ready to play
LOOK = """async () => {
    await window.MathJax?.startup?.promise;
    const films = [...document.querySelectorAll('video')];
    await Promise.all(films.map(film => film.play().catch(() => null)));
    const all = (selector, field) => [...document.querySelectorAll(selector)].map(node => node[field]);
    return {
        links: [...all('a[href]:not([href=""])', 'href'), ...all('iframe[src]', 'src')],
        anchors: [...all('[id]', 'id'), ...all('a[name]', 'name')],
        broken: [...document.images].filter(image => !image.complete || !image.naturalWidth).map(image => image.src),
        still: films.filter(film => film.error || !film.duration).map(film => film.currentSrc || 'no source'),
        raw: [...document.querySelectorAll('.math')].filter(node => !node.querySelector('mjx-container svg'))
            .map(node => node.textContent),
        wrong: all('[data-mjx-error], mjx-merror', 'textContent'),
        equations: document.querySelectorAll('mjx-container').length,
        moving: all('img[src$=".gif"], img[src^="data:image/gif"], video', 'src'),
    };
}"""


def look_at(page, folder: Path) -> tuple[list[str], dict[str, dict]]:
    """What is wrong with the pages in a folder, a line each, and what each page holds, by its path in the folder."""
    wrong, seen, here = [], {}, ""
    page.on("console", lambda said: said.type == "error" and wrong.append(f"{here}: console: {said.text}"))
    page.on("pageerror", lambda error: wrong.append(f"{here}: {error}"))
    page.on("requestfailed", lambda asked: wrong.append(f"{here}: did not load {asked.url[:200]}"))
    page.on("request", lambda asked: asked.url.startswith("http") and wrong.append(f"{here}: asked for {asked.url}"))
    page.route("http*://**", lambda route: route.abort())
    for path in sorted(folder.rglob("*.html")):
        here = path.relative_to(folder).as_posix()
        if not here.startswith("_static"):  # the theme's own fragments
            page.goto(path.as_uri(), wait_until="load")
            seen[here] = page.evaluate(LOOK)
    for here, held in seen.items():
        wrong += [
            f"{here}: {what}: {found[:200]}" for what in ("broken", "still", "raw", "wrong") for found in held[what]
        ]
        wrong += [f"{here}: leads nowhere: {link}" for link in held["links"] if not _leads(link, folder, seen)]
    return wrong, seen


def _leads(link: str, folder: Path, seen: dict) -> bool:
    address, anchor = urldefrag(link)
    if urlsplit(address).scheme != "file":
        return not address.startswith("http:")
    path = Path(url2pathname(urlsplit(address).path))
    if not path.is_file() or not path.is_relative_to(folder):
        return False
    held = seen.get(path.relative_to(folder).as_posix())
    return held is None or anchor in ("", *held["anchors"]) or unquote(anchor) in held["anchors"]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    missing = [name for name in TOOLS if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"needs {', '.join(missing)}: make site installs docs/requirements.txt")
    folder = tmp_path_factory.mktemp("built") / "site"
    command = [sys.executable, str(ROOT / "tools" / "build_site.py"), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in folder.parent.iterdir()] == ["site"], "nothing half-built is left"
    return folder


def test_every_page_is_whole_and_fetches_nothing(site, page):
    wrong, seen = look_at(page, site)
    assert wrong == []
    sources = [*ROOT.glob("*.md"), *ROOT.glob("notebooks/**/*.ipynb"), ROOT / "paper_figures" / "README.md"]
    modules = [path for path in (ROOT / "rasp_core").rglob("*.py") if path.stem not in ("__init__", "__main__")]
    pages = [path.relative_to(ROOT).with_suffix(".html") for path in sources if ".ipynb_checkpoints" not in path.parts]
    pages += ["api" / path.relative_to(ROOT).with_suffix(".html") for path in modules]
    assert {path.as_posix() for path in pages} <= seen.keys()
    front = {Path(url2pathname(urlsplit(link).path)) for link in seen["index.html"]["links"]}
    assert {site / path for path in pages if path.parts[0] in ("notebooks", "paper_figures")} <= front
    assert seen["notebooks/from_scratch.html"]["equations"] >= 10
    for name in ("04_strip_experiment", "09_multiview_art", "10_painted_art"):
        assert seen[f"notebooks/{name}.html"]["moving"], name
    films = [Image.open(path) for path in (site / "_images").glob("*.gif")]
    assert all(film.n_frames > 1 for film in films)
    assert sum(path.stat().st_size for path in site.rglob("*") if path.is_file()) < 60e6


def test_scenes_turn(site, page):
    scenes = sorted((site / "scenes").glob("*.html"))
    assert [path.stem for path in scenes] == sorted(path.stem for path in (ROOT / "paper_figures").glob("*.glb"))
    page.goto(scenes[0].as_uri())
    page.wait_for_function("typeof controls === 'object'")  # trimesh's page has read its scene

    def drawn():
        page.wait_for_timeout(500)
        return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), int)

    before = drawn()
    assert (before.min(2) < 200).mean() > 0.1, "objects before a white ground"
    page.mouse.move(700, 500)
    page.mouse.down()
    page.mouse.move(900, 550, steps=5)
    page.mouse.up()
    assert (np.abs(drawn() - before).max(2) > 50).mean() > 0.1


def test_gallery_shows_its_scenes(site, page):
    page.goto((site / "paper_figures" / "README.html").as_uri())
    frame = page.locator(".scenes iframe").first
    frame.scroll_into_view_if_needed()
    frame.content_frame.locator("canvas").wait_for()


def test_solutions_are_folded_and_widgets_leave_a_sentence(site, page):
    page.goto((site / "notebooks" / "exercises" / "2_what_does_not_repel.html").as_uri())
    solution = page.get_by_text('solution = "b"')
    assert not solution.is_visible()
    page.locator("details summary").click()
    assert solution.is_visible()
    page.goto((site / "notebooks" / "00_quickstart.html").as_uri())
    assert page.get_by_text("Sliders and buttons are here when the notebook runs").count() == 1
    assert page.get_by_text("VBox(").count() == 0


@pytest.mark.parametrize("name", ["docs/recorded", "notebooks/00_quickstart"])
def test_recorded_runs_are_drawn_with_three_js_and_their_sliders_change_the_picture(site, page, name):
    page.goto((site / f"{name}.html").as_uri())
    page.wait_for_function("!!document.querySelector('.rasp-recording')?.recording?.silhouette")
    canvas = page.locator(".rasp-recording canvas")

    def drawn():
        page.wait_for_timeout(200)
        return np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("RGB"), int)

    last = drawn()
    for slider, key in (("iteration", "Home"), ("iteration", "End"), ("epsilon (m)", "End"), ("lambda", "End")):
        page.locator(f".rasp-recording input[name='{slider}']").press(key)
        if slider != "epsilon (m)":  # which makes no difference at a small lambda
            assert ((np.abs(drawn() - last).max(2) > 60).mean() > 0.02) == (key == "Home" or slider == "lambda")


def test_search_finds_a_notebook(site, page):
    page.goto((site / "search.html").as_uri() + "?q=strip")
    page.locator("#search-results li", has_text="The strip").first.wait_for()


@pytest.mark.parametrize(("sphinx_fails", "pdoc_fails"), [(1, 0), (0, 1)])
def test_a_failed_build_leaves_the_last_site(tmp_path, monkeypatch, sphinx_fails, pdoc_fails):
    sphinx = pytest.importorskip("sphinx.cmd.build")
    monkeypatch.syspath_prepend(ROOT / "tools")
    import build_site

    pdoc = [sys.executable, "-c", f"raise SystemExit({pdoc_fails})"]
    monkeypatch.setattr(sphinx, "build_main", lambda options: sphinx_fails)
    monkeypatch.setattr(build_site, "start_api", lambda folder: subprocess.Popen(pdoc))
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "index.html").touch()
    with pytest.raises(SystemExit, match="was not built"):
        build_site.build(tmp_path / "site")
    assert list(tmp_path.rglob("*")) == [tmp_path / "site", tmp_path / "site" / "index.html"]


FAULTS = {
    "console: no": "<script>console.error('no')</script>",
    "thrown": "<script>throw new Error('thrown')</script>",
    "asked for http": "<img src='https://example.invalid/a.png'>",
    "did not load": "<link rel='stylesheet' href='gone.css'>",
    "broken": "<img src='gone.png'>",
    "still": "<video src='data:video/mp4;base64,AAAA'></video>",
    "raw": "<span class='math'>\\(x\\)</span>",
    "wrong: Undefined": "<mjx-merror>Undefined</mjx-merror>",
    "gone.html": "<a href='gone.html'>gone</a>",
    "whole.html#gone": "<a href='whole.html#gone'>gone</a>",
    "outside": "<a href='../outside.html'>outside</a>",
}


def test_faults_are_found(page, tmp_path):
    folder = tmp_path / "site"
    folder.mkdir()
    (tmp_path / "outside.html").touch()
    (folder / "whole.html").write_text("<p id='here'><a href='whole.html#here'>here</a>")
    for k, text in enumerate(FAULTS.values()):
        (folder / f"{k}.html").write_text(text)
    wrong, _ = look_at(page, folder)
    assert not any(line.startswith("whole.html") for line in wrong)
    for k, fault in enumerate(FAULTS):
        assert any(line.startswith(f"{k}.html: ") and fault in line for line in wrong), (fault, wrong)
