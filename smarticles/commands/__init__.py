"""Commands of `smarticles`, one module each.

The module `run` also has the command `resume`; `scene_files` has `init`, `keys` and `schema`.
"""
