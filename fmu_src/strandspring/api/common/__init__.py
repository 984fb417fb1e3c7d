"""What the results of all calls share: text, tables, plots, places of files, cautions."""
