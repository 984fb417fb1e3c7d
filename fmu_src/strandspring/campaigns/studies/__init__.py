"""Studies over grids and over springs drawn from the standard errors: in processes or on a cluster, with a journal."""
