"""Some hundred of the damaged files and odd arguments of `fuzz`; ten thousand by `python tests/fuzz.py`."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import fuzz


@pytest.mark.parametrize("words", [0.0, 1.0])
def test_no_input_ends_in_a_traceback(words):
    failed = fuzz.run(400 if words == 0 else 60, seed=1, words=words)
    assert not failed, "\n".join(f"{call}: {wrong}" for call, wrong in failed)


def test_the_fuzzer_notices(monkeypatch):
    def wrong(call):
        raise ZeroDivisionError("nobody caught this")

    monkeypatch.setattr(fuzz, "main", wrong)
    assert "nobody caught this" in fuzz.failure([])
    monkeypatch.setattr(fuzz, "main", lambda call: 2)
    assert "status 2 with 0 lines" in fuzz.failure([])
    monkeypatch.setattr(fuzz, "main", lambda call: 7)
    assert fuzz.failure([]) == "status 7"
    monkeypatch.setattr(fuzz, "main", lambda call: 0)
    assert fuzz.failure([]) is None
