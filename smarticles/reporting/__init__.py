"""HTML pages of `smarticles report`: `page` renders, `charts` draws, `run` and `sweep` choose content."""
