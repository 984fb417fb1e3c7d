"""A batch of springs about a nominal one, a file each, and ten kinds of damage that records come with."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from strandspring import Spring, SpringParameters
from strandspring.campaigns.batches.sources import SpringFile
from strandspring.campaigns.batches.spring_row import BatchWork, Finished
from synthetic import AMPLITUDE, MEAN, spring_of

NOMINAL = spring_of(1.0, 1.2)
_SCATTER = 0.05  # of stiffness, kappa_omega, rho, sigma and n from spring to spring
_NOISE = 0.005  # of the force, share of its rms
_SHARES = (0.4, 0.7, 1.0)


def one_of(seed: int, stiffness: float = 1.0) -> SpringParameters:
    """A spring of the batch."""
    share = np.exp(_SCATTER * np.random.default_rng(seed).standard_normal(5)).tolist()
    return replace(
        NOMINAL,
        kE=tuple(stiffness * share[0] * c for c in NOMINAL.kE),
        kappa_omega=share[1] * NOMINAL.kappa_omega,
        rho=share[2] * NOMINAL.rho,
        sigma=share[3] * NOMINAL.sigma,
        n=share[4] * NOMINAL.n,
    )


def measured(seed: int, rows: int = 3000, stiffness: float = 1.0) -> np.ndarray:
    """Time [s], displacement [mm] and force [N] of two cycles at each of three amplitudes, shape (rows, 3)."""
    time = 6.0 * np.arange(rows) / rows
    share = np.take(_SHARES, (time / 2.0).astype(int))
    path = MEAN + AMPLITUDE * share * np.sin(2.0 * np.pi * time)
    force = Spring(one_of(seed, stiffness)).response(path)
    noise = _NOISE * float(np.sqrt(np.mean(force**2))) * np.random.default_rng((seed, 1)).standard_normal(rows)
    return np.column_stack([time, 1e3 * path, force + noise])


def write(path: Path, table: np.ndarray, header: str = "time [s],displacement [mm],force [N]") -> None:
    """A record as a rig writes it."""
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt=["%.4f", "%.5f", "%.4f"])


def write_batch(folder: Path, count: int, rows: int = 3000, first: int = 0) -> list[Path]:
    """Files of springs `first` and so on."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"spring_{seed:04d}.csv" for seed in range(first, first + count)]
    for seed, path in enumerate(paths, first):
        write(path, measured(seed, rows))
    return paths


def _snapping(table: np.ndarray) -> np.ndarray:
    """The force collapses beyond half the largest amplitude."""
    beyond = table[:, 1] > 1e3 * (MEAN + 0.5 * AMPLITUDE)
    return np.column_stack([table[:, 0], table[:, 1], np.where(beyond, -table[:, 2], table[:, 2])])


def _with_blanks(path: Path, table: np.ndarray) -> None:
    lines = [f"{t:.4f},{x:.5f},{'NaN' if k % 100 == 50 else f'{f:.4f}'}" for k, (t, x, f) in enumerate(table.tolist())]
    path.write_text("\n".join(["time [s],displacement [mm],force [N]", *lines, ""]))


def _unreadable(path: Path, table: np.ndarray) -> None:
    """A file without the right to read it; root may read any, and gets a link to itself."""
    if os.geteuid() == 0:
        path.symlink_to(path)
    else:
        write(path, table)
        path.chmod(0)


# Each writes a damaged file; the status that it gets, and a part of the reason.
DAMAGES: dict[str, tuple[Callable[[Path, np.ndarray], object], str, str]] = {
    "empty": (lambda path, _: path.write_bytes(b""), "unreadable", "the file is empty"),
    "binary": (
        lambda path, _: path.write_bytes(np.random.default_rng(0).bytes(4000)), "unreadable", "",
    ),
    "truncated": (
        lambda path, table: write(path, table[: len(table) // 20]), "refused", "does not go back and forth",
    ),
    "swapped": (
        lambda path, table: write(path, table[:, [0, 2, 1]]), "refused", "wrong way round",
    ),
    "constant": (
        lambda path, table: write(path, table * [1.0, 1.0, 0.0]), "unreadable", "the force must change, found 0",
    ),
    "nan": (_with_blanks, "unreadable", "line 52"),
    "folder": (lambda path, _: path.mkdir(), "unreadable", "is a folder"),
    "forbidden": (_unreadable, "unreadable", "cannot be read"),
    "unit": (
        lambda path, table: write(path, table, "time [s],displacement [m],force [N]"), "unreadable", "is the unit mm?",
    ),
    "snap": (lambda path, table: write(path, _snapping(table)), "refused", "snap-through"),
}  # fmt: skip


def write_damaged(folder: Path, rows: int = 3000) -> list[Path]:
    """One file of each damage."""
    paths = []
    for seed, (name, (damage, _, _)) in enumerate(DAMAGES.items()):
        paths.append(folder / f"damaged_{name}.csv")
        damage(paths[-1], measured(seed, rows))
    return paths


class DeadlyWork(BatchWork):
    """Dies of every file called deadly, always or, where its folder holds "once", once."""

    def rows(self, tasks: Sequence[SpringFile]) -> list[Finished]:
        for spring in tasks:
            if spring.name.startswith("deadly"):
                once = Path(spring.path).with_name("once")
                if not once.exists():
                    os._exit(9)
                if once.read_text() == "":
                    once.write_text("died")
                    os._exit(9)
        return super().rows(tasks)
