"""A scene: what is given and what happens, joined, checked and read."""
