"""Identification: records in, a physically possible spring with its figures out, or a named refusal."""
