"""One page that tells everything of a run, a sweep or a study; `smarticles report` writes it.

`page` knows HTML and nothing of smarticles; `charts` draws; `run`, `sweep` and `results` say what stands on a page.
"""
