"""The report of an identification: a self-contained HTML file."""
