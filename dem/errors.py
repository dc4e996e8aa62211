"""The two ways in which the project says no."""


class InputError(ValueError):
    """The input is wrong: a scene, a file, a command line. Exit status 2."""


class RunError(RuntimeError):
    """A run failed: unstable, not settled, out of disk. Exit status 1."""
