"""Systems with stranded wire springs, each a script: ``python -m strandspring.examples.recoil``."""
