"""How content becomes a page that opens offline, a document for print, or axes of matplotlib."""
