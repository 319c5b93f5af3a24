"""A bar says what it counts, seldom in a log file, and nothing if it is not shown."""

import sys

import pytest

from rasp_core.util import progress


def test_a_bar_counts_on_standard_error(capsys):
    with progress.progress_bar("pack", "it", shown=True, total=3) as bar:
        bar.update(2)
        bar.refresh()
    said = capsys.readouterr()
    assert said.out == ""
    assert "pack" in said.err
    assert "2/3" in said.err


def test_a_bar_that_is_not_shown_says_nothing(capsys):
    with progress.progress_bar("pack", "it", shown=False) as bar:
        bar.update()
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("terminal", "seconds"), [(True, progress.TERMINAL_SECONDS), (False, progress.LOG_SECONDS)])
def test_a_log_file_gets_few_lines(monkeypatch, terminal, seconds):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal, raising=False)
    with progress.progress_bar("pack", "it", shown=True) as bar:
        assert bar.mininterval == seconds
