"""C sources of the package as binaries: targets and flags, the compiler, and where finished images are kept."""
