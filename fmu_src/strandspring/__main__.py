"""`python -m strandspring` is the command `strandspring`."""

import sys

from .ground.endings import handled_endings, interrupt, status_and_sentence


def main() -> None:
    """Run the command line; signals that end it are answered before it is loaded, which takes a while, and until the
    process has left.
    """
    try:
        with handled_endings(interrupt, to_the_end=True):
            from .cli.main import main as command_line

            command_line()
    except KeyboardInterrupt as end:  # before the command began, or a second one while the first was answered
        status, sentence = status_and_sentence(end)
        sys.stderr.write(f"strandspring: {sentence}\n")
        sys.exit(status)


if __name__ == "__main__":
    main()
