"""The programs finshell-plot, finshell-fit and finshell-mesh: a sentence where a package that they need is not installed."""
from __future__ import annotations

import sys
from importlib import import_module

_NEEDS = {"plot": "h5py matplotlib scipy", "fit": "h5py matplotlib scipy", "mesh": "meshio"}


def _start(program: str) -> int:
    try:
        main = import_module(f"finshell.{program}").main
    except ImportError as reason:
        print(f"finshell-{program}: {reason}; `pip install {_NEEDS[program]}` installs what it needs", file=sys.stderr)
        return 2
    return int(main())


def plot() -> int:
    """finshell-plot."""
    return _start("plot")


def fit() -> int:
    """finshell-fit."""
    return _start("fit")


def mesh() -> int:
    """finshell-mesh."""
    return _start("mesh")
