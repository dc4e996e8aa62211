"""One HTML page of a run, a sweep or a study, which `smarticles report` writes.

`page` makes HTML and knows nothing of smarticles; `charts` draws; `run` and `sweep` decide what stands on a page.
"""
