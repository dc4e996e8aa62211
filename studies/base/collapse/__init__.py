"""How free-standing columns lose their height, and how long that takes."""
