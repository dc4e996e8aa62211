"""The engine on YADE, and the only package that uses YADE."""
