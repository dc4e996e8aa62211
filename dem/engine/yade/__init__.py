"""The engine on YADE: the only package that knows it."""
