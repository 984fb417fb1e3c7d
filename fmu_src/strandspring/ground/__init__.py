"""What everything stands on: files, locks, scratch folders, children, strict formats, arguments."""
