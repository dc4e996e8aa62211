"""A sweep file becomes run directories."""
