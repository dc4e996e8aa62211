"""Files of a run: names, formats, writers and readers."""
