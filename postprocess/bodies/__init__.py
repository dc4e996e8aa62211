"""True bodies of a run at a time, as meshes with fields: what pictures draw, exports write, and pages show."""
