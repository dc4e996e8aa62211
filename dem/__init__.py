"""Scene, particle, engine, phases and recording of smarticle runs."""
