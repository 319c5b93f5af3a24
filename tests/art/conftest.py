from read_back import runs_are_read_back  # noqa: F401
