"""Downloads over a real HTTP server on loopback that serves, truncates, corrupts, stalls and answers 404."""

import hashlib
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

import data_fetch
from data_fetch import errors, fetchers, registry

DATA = b"v 0 0 0\n" * 5000


class Handler(BaseHTTPRequestHandler):
    def do_GET(self):
        if self.path == "/gone":
            self.send_error(404)
            return
        body = DATA.replace(b"0", b"1") if self.path == "/corrupt" else DATA
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.path in ("/truncate", "/stall"):
            self.wfile.write(body[:1000])
            self.wfile.flush()
            time.sleep(1.5 if self.path == "/stall" else 0)
        else:
            self.wfile.write(body)

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def server():
    httpd = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=httpd.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{httpd.server_address[1]}"
    httpd.shutdown()
    httpd.server_close()


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("RASP_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv(fetchers.MIRROR, raising=False)
    return tmp_path / "cache"


def entry(url):
    return registry.Entry("kitchen", "thing.obj", len(DATA), hashlib.sha256(DATA).hexdigest(), url, "none")


def files(folder):
    return [path for path in folder.rglob("*") if path.is_file()]


def test_a_file_is_fetched_once_and_then_taken_from_the_cache(server, cache):
    (path,) = fetchers.fetch_entries([entry(f"{server}/good")])
    assert path.read_bytes() == DATA
    (again,) = fetchers.fetch_entries([entry("http://127.0.0.1:9/unreachable")])
    assert again == path
    assert files(cache) == [path]


def test_a_damaged_file_in_the_cache_is_fetched_again(server, cache):
    (path,) = fetchers.fetch_entries([entry(f"{server}/good")])
    path.write_bytes(b"damaged")
    assert fetchers.fetch_entries([entry(f"{server}/good")])[0].read_bytes() == DATA


@pytest.mark.parametrize(
    ("where", "error", "says"),
    [
        ("/gone", errors.NotOnServer, "404 instead of thing.obj"),
        ("/corrupt", errors.HashMismatch, "nothing was kept"),
        ("/truncate", errors.DownloadInterrupted, f"{len(DATA)} bytes|stalled"),
        ("/stall", errors.DownloadInterrupted, "stalled"),
    ],
)
def test_what_goes_wrong_has_a_name_and_leaves_nothing(server, cache, where, error, says):
    with pytest.raises(error, match=says) as caught:
        fetchers.fetch_entries([entry(server + where)], timeout=0.5)
    assert "RASP_DATA_MIRROR" in str(caught.value)
    assert files(cache) == []


def test_no_network_is_told_apart(cache):
    with pytest.raises(errors.NoNetwork, match="cannot be reached"):
        fetchers.fetch_entries([entry("http://127.0.0.1:9/closed")], timeout=0.5)
    assert files(cache) == []


def test_a_cache_that_cannot_be_written_is_named(server, cache):
    cache.parent.mkdir(exist_ok=True)
    cache.write_text("a file where the folder should be")
    with pytest.raises(errors.FetchError, match="RASP_CACHE"):
        fetchers.fetch_entries([entry(f"{server}/good")])


def test_a_mirror_serves_the_same_registry(tmp_path, monkeypatch, cache):
    monkeypatch.setenv(fetchers.MIRROR, str(tmp_path))
    (tmp_path / "kitchen").mkdir()
    wanted = entry("http://127.0.0.1:9/never")
    with pytest.raises(errors.MissingInMirror, match=r"thing\.obj: not in the mirror"):
        fetchers.fetch_entries([wanted])
    (tmp_path / "kitchen" / "thing.obj").write_bytes(DATA[:-1])
    with pytest.raises(errors.HashMismatch, match=f"of {len(DATA) - 1} bytes found"):
        fetchers.fetch_entries([wanted])
    (tmp_path / "kitchen" / "thing.obj").write_bytes(DATA)
    assert fetchers.fetch_entries([wanted]) == [tmp_path / "kitchen" / "thing.obj"]
    assert files(cache) == []


def test_every_set_has_a_fetcher_that_says_where_it_comes_from():
    for group in registry.GROUPS:
        text = getattr(data_fetch, f"fetch_{group}").__doc__
        for word in ("Cite", "files", "Raises FetchError"):
            assert word in " ".join(text.split()), group


@pytest.mark.real_data
@pytest.mark.parametrize("group", registry.GROUPS)
def test_every_fetcher_serves_the_mirror(data, monkeypatch, group):
    monkeypatch.setenv(fetchers.MIRROR, str(data))
    paths = getattr(data_fetch, f"fetch_{group}")()
    assert len(paths) == len(registry.entries(group))
    assert all(path.is_relative_to(data) for path in paths)


@pytest.mark.network
def test_the_first_kitchen_object_is_still_at_its_url():
    assert fetchers.fetch_entries(registry.entries("kitchen")[:1])[0].exists()
