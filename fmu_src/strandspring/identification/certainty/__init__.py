"""How far a fit can be trusted: figures of the saved spring, standard errors, intervals, misfit."""
