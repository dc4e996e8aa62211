"""Parts of a scene as data: smarticle, container, hooks, contact, motors, motions, fidelity, recording."""
