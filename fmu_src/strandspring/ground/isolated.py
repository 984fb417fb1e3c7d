"""How Python is started without the current folder on its path: what lies beside records must not be imported.

That folder comes first for a program that is given by `-c`, and from 3.13 on `linecache` is imported before the program
runs. The option against that came with 3.11; `-I` would also leave out what the user has set, such as PYTHONPATH.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

# Options that stand before `-c` and a program. For Python 3.10 they are a program that runs the other.
_PROGRAM = "import sys; sys.path[:] = filter(None, sys.path); del sys.argv[1]; exec(sys.argv.pop(1))"
ISOLATED = ("-P",) if sys.version_info >= (3, 11) else ("-c", _PROGRAM)

_lock = threading.Lock()


@contextmanager
def isolated_processes() -> Iterator[None]:
    """Processes that multiprocessing starts in this block are isolated, and know nothing of this program."""
    from multiprocessing import util

    settings: Any = util
    with _lock:
        main, flags = sys.modules["__main__"], settings._args_from_interpreter_flags
        # Each process would run the user's script again, which may lack a guard against that.
        sys.modules["__main__"] = ModuleType("__main__")
        # Options of this interpreter are handed on, and there is no setting for others.
        settings._args_from_interpreter_flags = lambda: [*flags(), *ISOLATED]
        try:
            yield
        finally:
            settings._args_from_interpreter_flags = flags
            sys.modules["__main__"] = main
