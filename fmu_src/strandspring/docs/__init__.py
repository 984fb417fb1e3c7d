"""The documentation: pages for each reader, built into one that opens offline."""
