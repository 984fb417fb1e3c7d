"""The report of an identification: one HTML file that stands alone."""
