"""Many independent runs at once, on Dask: local processes, or any cluster by its scheduler's address.

A run is a call of an importable function with plain parameters that returns plain values. Its result is written to the
sweep's folder the moment that it arrives, so that a sweep that was interrupted does only what is missing when it is
started again; a run whose worker dies is repeated on another one.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from tqdm.auto import tqdm

from ..io.atomic_files import whole
from ..util.errors import InputError

DEATHS = 10  # workers that may die under one run before it is given up


def grid(**values: Iterable) -> list[dict]:
    """Every combination of the parameters' values, the last parameter running fastest."""
    return [dict(zip(values, row, strict=True)) for row in itertools.product(*values.values())]


def sweep(
    function: Callable[..., dict],
    runs: Sequence[Mapping],
    folder: str | Path,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
) -> list[dict]:
    """`function(**run)` for each of `runs`; the results in their order.

    function : importable by name where the workers are, returns what JSON can hold. runs : parameters that JSON can
    hold. folder : one file `<key>.json` for each finished run; what is there already is not run again. workers : local
    processes, as many as there are cores where None, each computing on one thread. scheduler : the address of a
    running Dask cluster instead (`tcp://host:8786`); files that the runs read must be there under the same paths.

    Raises InputError where a run raised an error, after all others have finished, or the folder or the scheduler cannot
    be used. Ctrl-C leaves what has finished in the folder.
    """
    if workers is not None and workers < 1:
        raise InputError(f"a sweep needs at least one worker, got {workers}")
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); name another folder") from error
    paths = [folder / f"{_key(function, run)}.json" for run in runs]
    results = {path: _read(path) for path in paths}
    missing = {path: run for path, run in zip(paths, runs, strict=True) if results[path] is None}
    failed = []
    if missing:
        with _client(scheduler, min(workers or os.cpu_count() or 1, len(missing))) as client:
            for path, result, error in _compute(client, function, missing, progress):
                if error is not None:
                    failed.append(f"{_words(missing[path])}: {type(error).__name__}: {error}")
                    continue
                _write(path, {"function": _name(function), "parameters": dict(missing[path]), "result": result})
                results[path] = result
    if failed:
        raise InputError(f"{len(failed)} of {len(runs)} runs failed, the others are kept in {folder}; {failed[0]}")
    return [results[path] for path in paths]


def _compute(client, function: Callable, missing: Mapping[Path, Mapping], progress: bool):
    """Yields path, result and error of each run as it ends."""
    from distributed import as_completed

    futures = {client.submit(function, **run, key=path.stem, pure=False): path for path, run in missing.items()}
    with tqdm(total=len(futures), disable=not progress, desc="sweep", unit="run", leave=False) as bar:
        for future in as_completed(futures):
            bar.update()
            error = future.exception()
            yield futures[future], None if error else future.result(), error
            future.release()


@contextmanager
def _client(scheduler: str | None, workers: int):
    """A Dask client, of a local cluster of processes where no scheduler is named."""
    import dask
    from distributed import Client, LocalCluster

    if scheduler is not None:
        try:
            client = Client(scheduler, timeout="10s")
        except (OSError, ValueError) as error:
            raise InputError(f"no Dask scheduler answers at {scheduler}; start one with: dask scheduler") from error
        with client:
            yield client
        return
    quiet = {"distributed.scheduler.allowed-failures": DEATHS, "distributed.comm.timeouts.connect": "60s"}
    with (
        dask.config.set(quiet),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            silence_logs="CRITICAL",
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _name(function: Callable) -> str:
    return f"{function.__module__}.{function.__qualname__}"


def _key(function: Callable, run: Mapping) -> str:
    """A run's name: the function's, and a hash of its parameters. Raises InputError for what JSON cannot hold."""
    try:
        text = json.dumps(dict(run), sort_keys=True)
    except TypeError as error:
        raise InputError(f"a run's parameters must be numbers, texts or lists of them: {error}") from error
    return f"{function.__name__}-{hashlib.sha256(text.encode()).hexdigest()[:16]}"


def _words(run: Mapping) -> str:
    return ", ".join(f"{name} {value}" for name, value in run.items())


def _read(path: Path) -> dict | None:
    """A finished run's result; None where there is none, or a damaged one."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))["result"]
    except (OSError, ValueError, KeyError):
        return None


def _write(path: Path, record: dict) -> None:
    with whole(path) as part:
        part.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
