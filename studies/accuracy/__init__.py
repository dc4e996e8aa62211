"""What accuracy costs: the ladder of one scene, each knob turned by itself; the command `smarticles accuracy`."""
