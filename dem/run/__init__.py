"""One run: a scene in, a run directory out."""
