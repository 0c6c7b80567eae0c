"""One collision for its reader: folder, terminal, page and figure."""
