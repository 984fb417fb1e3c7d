"""Wider classes of springs: Maxwell branches and a second friction mechanism, where the records show them."""
