"""Cases that are hard on the engine."""
