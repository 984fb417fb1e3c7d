"""Everything that travels inside an FMU, and nothing else: the folder is the list.

The standard library is all that these files use, and `facade` pythonfmu. The C sources in ``c`` travel with the native
FMU; the other files with the Python-backed one.
"""
