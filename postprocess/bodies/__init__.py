"""True bodies of a run at a time, as meshes with fields, for pictures, exports and pages."""
