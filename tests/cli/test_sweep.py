"""Sweeps: nothing lost and nothing twice, whatever dies."""

import json
import os
import signal
import threading
import time
from pathlib import Path

import pytest

from rasp_core.cli.sweep import grid, sweep
from rasp_core.util.errors import InputError


def square(folder: str, number: int, seconds: float = 0.0) -> dict:
    """Leaves a trace when it starts and when it ends."""
    Path(folder, f"started-{number}-{os.getpid()}").touch()
    time.sleep(seconds)
    if number < 0:
        raise ValueError("negative")
    with open(Path(folder, "ended"), "a") as file:
        file.write(f"{number}\n")
    return {"square": number * number}


def ended(folder: Path) -> list[int]:
    return sorted(int(line) for line in (folder / "ended").read_text().split())


def test_grid_is_every_combination():
    assert grid(a=[1, 2], b="xy") == [{"a": 1, "b": "x"}, {"a": 1, "b": "y"}, {"a": 2, "b": "x"}, {"a": 2, "b": "y"}]


def test_results_in_order_and_only_the_missing_again(tmp_path):
    out = tmp_path / "out"
    runs = grid(folder=[str(tmp_path)], number=range(4))
    assert sweep(square, runs, out, workers=2) == [{"square": n * n} for n in range(4)]
    files = sorted(out.iterdir())
    assert len(files) == 4
    record = json.loads(files[0].read_text())
    assert record["result"]["square"] == record["parameters"]["number"] ** 2
    assert record["function"] == f"{square.__module__}.square"
    files[0].unlink()
    files[1].write_text('{"half a rec')
    lost = {r["number"] for r in runs} - {json.loads(f.read_text())["parameters"]["number"] for f in files[2:]}
    assert sweep(square, runs, out, workers=1) == [{"square": n * n} for n in range(4)]
    assert ended(tmp_path) == sorted([*range(4), *lost])


def test_a_killed_workers_run_is_repeated_elsewhere_and_nothing_twice(tmp_path):
    runs = grid(folder=[str(tmp_path)], number=range(6), seconds=[1.0])

    def kill():
        while not (victims := list(tmp_path.glob("started-1-*"))):
            time.sleep(0.01)
        os.kill(int(victims[0].name.split("-")[2]), signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    assert sweep(square, runs, tmp_path / "out", workers=2) == [{"square": n * n} for n in range(6)]
    killer.join()
    assert len(list(tmp_path.glob("started-1-*"))) == 2
    assert ended(tmp_path) == list(range(6))


def test_a_clusters_address(tmp_path):
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        runs = grid(folder=[str(tmp_path)], number=[3])
        assert sweep(square, runs, tmp_path / "out", scheduler=cluster.scheduler_address) == [{"square": 9}]


def test_one_failed_run_is_named_and_the_others_kept(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(InputError, match=r"1 of 3 runs failed.*number -1.*ValueError: negative"):
        sweep(square, grid(folder=[str(tmp_path)], number=[1, -1, 2]), out, workers=1)
    assert len(list(out.iterdir())) == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [({"workers": 0}, "at least one worker"), ({"scheduler": "tcp://127.0.0.1:9"}, "dask scheduler")],
)
def test_bad_input_is_refused(tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        sweep(square, grid(folder=[str(tmp_path)], number=[1]), tmp_path / "out", **options)


def test_parameters_must_be_plain(tmp_path):
    with pytest.raises(InputError, match="numbers, texts or lists"):
        sweep(square, [{"folder": tmp_path, "number": 1}], tmp_path / "out")


def test_the_folder_must_be_writable(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be written"):
        sweep(square, [{"folder": str(tmp_path), "number": 1}], tmp_path / "file")
