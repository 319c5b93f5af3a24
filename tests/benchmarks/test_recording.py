"""A recorded run of 40 objects in headless Chromium: seconds a frame; 1/30 is what is wanted."""

import chromium
import pytest

from data_fetch import kitchen_like
from rasp_core.geometry.containers import box
from rasp_core.problem import Settings
from rasp_core.visualize.recording import record

pytestmark = chromium.NEEDED
SECONDS_A_FRAME = """async (frames) => {
    const { show } = document.querySelector(".rasp-recording").recording;
    const gl = document.querySelector(".rasp-recording canvas").getContext("webgl2"), one = new Uint8Array(4);
    const start = performance.now();
    for (let k = 0; k < frames; k++) {
        show(k % 100);
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, one); // waits until it is drawn
    }
    return (performance.now() - start) / 1000 / frames;
}"""


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """A page with a recording of 40 objects and 100 frames."""
    bodies, room = kitchen_like(40), box((0.38, 0.38, 0.38))
    settings = Settings(iterations=100, resolution=64, query_points=20_000)
    path = record(bodies, room, settings).save(tmp_path_factory.mktemp("page") / "run.html")
    with chromium.pages() as new_page:
        page = new_page()
        page.goto(path.as_uri())
        page.wait_for_function("!!document.querySelector('.rasp-recording')?.recording?.silhouette")
        page.evaluate(SECONDS_A_FRAME, 20)
        yield page


def test_frames(benchmark, shown):
    benchmark.extra_info["seconds a frame"] = benchmark.pedantic(
        shown.evaluate, args=(SECONDS_A_FRAME, 60), rounds=5, iterations=1
    )
