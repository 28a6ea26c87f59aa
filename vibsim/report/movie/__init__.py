"""Movies of runs: the drawn system above a window that moves along the solution, as frames and as files."""
