"""What a designer reads off simulated load cases; verdicts against limits, margins, cautions, spread, spectra."""
