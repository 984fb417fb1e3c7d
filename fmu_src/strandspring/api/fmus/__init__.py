"""FMUs and other files of a spring, and their verification."""
