"""Scenes as input of other simulators: what is passive, complete, with a word on every choice."""
