"""What is given before anything happens: smarticle, container, contact, motors, fidelity, recording; as data."""
