"""Systems that such springs are made for, each a script: ``python -m strandspring.examples.recoil``."""
