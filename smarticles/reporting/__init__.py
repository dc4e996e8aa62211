"""HTML pages of runs, sweeps and studies for `smarticles report`.

Modules: `page` renders HTML, `charts` draws figures, `run` and `sweep` choose the content.
"""
