"""`python -m strandspring` is the command `strandspring`."""

from .cli.main import main

if __name__ == "__main__":
    main()
