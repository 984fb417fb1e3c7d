"""Completion in shells: click completes commands and options, here file names are added."""

from __future__ import annotations

from click.shell_completion import (
    BashComplete,
    CompletionItem,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
)


class _FilesToo(ShellComplete):
    """Offers files where nothing else fits, as shells do for programs that they do not know."""

    def get_completions(self, args: list[str], incomplete: str) -> list[CompletionItem]:
        return super().get_completions(args, incomplete) or [CompletionItem(incomplete, type="file")]


def offer_files() -> None:
    """Make the completion of all shells offer files."""
    for shell in (BashComplete, ZshComplete, FishComplete):
        add_completion_class(type(shell.__name__, (_FilesToo, shell), {}))
