"""Commands of `smarticles`, one module each; `run` has `resume` too, `scene_files` has `init` and `schema`."""
