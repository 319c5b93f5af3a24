"""Where things are kept between runs, also on machines with a read-only install or without a home."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

PACKAGE = Path(__file__).parent.parent


def cache_folder() -> Path:
    """`$RASP_CACHE`, else a folder in the user's cache, else one among temporary files; it need not be there yet."""
    if given := os.environ.get("RASP_CACHE"):
        return Path(given)
    root = _users_cache()
    return temporary_folder() if root is None else root / "rasp-kit"


def _users_cache() -> Path | None:
    """The user's cache folder, None without a home that can be written to."""
    try:
        root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # a user without a home
        return None
    return root if _writable(root) else None


def temporary_folder() -> Path:
    """A folder of this user among temporary files."""
    return Path(tempfile.gettempdir()) / f"rasp-kit-{os.getuid() if hasattr(os, 'getuid') else 'user'}"


def let_numba_cache(package: Path = PACKAGE) -> None:
    """Name a folder for compiled loops if numba would find none, beside them or in the user's cache: then it would
    refuse to import them."""
    if "NUMBA_CACHE_DIR" in os.environ or _writable(package / "kernels" / "__pycache__"):
        return
    root = _users_cache()
    if root is None or not _writable(root / "numba"):
        os.environ["NUMBA_CACHE_DIR"] = str(temporary_folder() / "numba")


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
