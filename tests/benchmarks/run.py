"""Figures that the pages quote, one benchmark a name: python tests/benchmarks/run.py NAME [OPTION ...]

`run.py NAME --help` lists the options; seeds are fixed, and times are compared within one run. All of them take hours.
"""

from __future__ import annotations

import argparse
import inspect
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

# Before NumPy is imported: processor time of threads that wait for each other says nothing.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "helpers"), str(HERE.parent)]


def benchmarks() -> dict[str, Callable[..., None]]:
    import held_out
    import honesty
    import speed

    functions = (
        honesty.clean, honesty.faults, honesty.spans, honesty.zoo, held_out.held_out, speed.kernel,
        speed.identify_time, speed.isolation, speed.bodies, speed.native, speed.startup,
    )  # fmt: skip
    return {function.__name__.replace("_", "-"): function for function in functions}


def main() -> None:
    """A subcommand for each name, with an option for each parameter of its function."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="name", metavar="NAME", required=True)
    for name, function in benchmarks().items():
        about = inspect.getdoc(function).replace("%", "%%")
        command = commands.add_parser(name, help=about.splitlines()[0], description=about)
        for option, parameter in inspect.signature(function).parameters.items():
            usual = parameter.default
            kind = {"action": "store_true"} if isinstance(usual, bool) else {"type": type(usual), "default": usual}
            command.add_argument(f"--{option}", help="" if isinstance(usual, bool) else f"{usual!r} by default", **kind)
    options = vars(parser.parse_args())
    name = options.pop("name")
    print(f"{name}: {', '.join(f'{option} {value}' for option, value in options.items())}", flush=True)
    warnings.simplefilter("ignore")  # paths that leave the range that was fitted
    benchmarks()[name](**options)


if __name__ == "__main__":
    main()
