"""What phases have in common in which motors are at work: gaits, their compiled form, their checks, their stage."""
