"""Parts of a scene as data, such as smarticle, container, contact, motors and recording."""
