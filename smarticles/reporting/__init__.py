"""HTML pages for `smarticles report`: `page` renders, `charts` draws, `run` and `sweep` choose the content."""
