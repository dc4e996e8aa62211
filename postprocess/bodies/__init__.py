"""Meshes of the bodies of a run with fields and colours, for pictures, exports and the viewer."""
