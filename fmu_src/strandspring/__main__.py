"""`python -m strandspring` is the command `strandspring`."""

import os
import sys

# The current folder comes first then: what lies beside records must not be taken for a module.
if sys.path[0] == os.getcwd():  # noqa: PTH109 (pathlib takes its time)
    del sys.path[0]

from .cli.main import main

if __name__ == "__main__":
    main()
