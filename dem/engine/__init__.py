"""The running simulation behind one interface."""

ENGINES = ("yade", "links")
"""Names of the engines, the default first; `dem.engine.kinds` makes them."""
