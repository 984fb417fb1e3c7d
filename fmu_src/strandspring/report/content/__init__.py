"""What pages and documents consist of, apart from their form: text, tables, charts as data, numbers in words."""
