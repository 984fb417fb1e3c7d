"""Planning of a test: the displacement programme that decides what is still open about a spring."""
