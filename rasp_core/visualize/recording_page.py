"""A recording as a page, and as a notebook's cell: `recording.js`, with three.js where it is at hand.

A page holds all that it needs. A cell's HTML holds the data and `recording.js` alone, which draws on a plain canvas
where the page around it has no three.js, as notebooks are to stay small; the site has it once. Where there is a kernel
the cell is an anywidget, which asks it for three.js and keeps that out of the notebook.

three.js is the one that trimesh brings for its own pages (MIT licence, which stands at its head), so requirements.lock
pins it.
"""

from __future__ import annotations

from functools import lru_cache
from importlib import resources

WIDGET = "application/vnd.jupyter.widget-view+json"
THREE_ENDS = 'Object.defineProperty(t,"__esModule",{value:!0})}));'
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title><style>body {{ margin: 0 auto; max-width: 75rem; }}</style>
<script>{three}</script></head>
<body>{shown}</body></html>
"""
# a widget's: the kernel sends three.js; where there is none, nothing answers, and the canvas does
RENDER = """
let asked;
function three(model) {
  asked ??= new Promise((resolve) => {
    setTimeout(resolve, 3000);
    model.on("msg:custom", (message, [source]) => {
      const exports = {};
      new Function("exports", "module", new TextDecoder().decode(source))(exports, {});
      resolve(exports);
    });
    model.send({ wanted: "three.js" });
  });
  return asked;
}
export default {
  async render({ model, el }) {
    const element = el.appendChild(document.createElement("div"));
    await raspRecording(element, JSON.parse(model.get("recording")), await three(model));
  },
};
"""


def page(data: str, title: str = "A recorded run") -> str:
    """The HTML page of a recording's JSON text; it needs no network and no kernel."""
    return PAGE.format(title=title, three=three_js(), shown=cell(data))


def cell(data: str, picture: str = "") -> str:
    """HTML that shows a recording's JSON text wherever scripts run, on a page with three.js or without. picture : HTML
    that is there where they do not."""
    safe = data.replace("<", "\\u003c")  # a name may hold </script>
    held = f'<div class="rasp-recording">{picture}<script type="application/json">{safe}</script></div>'
    return f"{held}<script>{module()}</script>"


def bundle(data: str, words: str, picture: str) -> dict[str, object]:
    """What a notebook keeps of a recording's JSON text, by MIME type: words, HTML as of `cell`, and the widget where
    there is a kernel."""
    from IPython import get_ipython

    held: dict[str, object] = {"text/plain": words, "text/html": cell(data, picture)}
    if hasattr(get_ipython(), "kernel"):
        held[WIDGET] = widget(data)._repr_mimebundle_()[0][WIDGET]
    return held


def widget(data: str):
    """An anywidget that shows a recording's JSON text; it keeps the data and `recording.js`, not three.js."""
    import anywidget
    import traitlets

    class Shown(anywidget.AnyWidget):
        _esm = module() + RENDER
        recording = traitlets.Unicode().tag(sync=True)

    shown = Shown(recording=data)
    shown.on_msg(lambda one, message, buffers: one.send({}, [three_js().encode()]))
    return shown


@lru_cache
def module() -> str:
    """The text of `recording.js`."""
    return (resources.files(__package__) / "recording.js").read_text(encoding="utf-8")


@lru_cache
def three_js() -> str:
    """The text of three.js, a classic script that makes the name THREE."""
    from trimesh.viewer.notebook import scene_to_html

    from .gltf import _Exported

    _, _, text = scene_to_html(_Exported(b"")).partition("<script>")
    return text[: text.index(THREE_ENDS) + len(THREE_ENDS)]
