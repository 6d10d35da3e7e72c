"""The programs finshell-plot and finshell-fit: a sentence where a package that they need is not installed."""
from __future__ import annotations

import sys
from importlib import import_module


def _start(program: str) -> int:
    try:
        main = import_module(f"finshell.{program}").main
    except ImportError as reason:
        print(f"finshell-{program}: {reason}; `pip install h5py matplotlib scipy` installs what it needs", file=sys.stderr)
        return 2
    return int(main())


def plot() -> int:
    """finshell-plot."""
    return _start("plot")


def fit() -> int:
    """finshell-fit."""
    return _start("fit")
