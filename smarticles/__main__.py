"""Run the console command: `smarticles`, or `python -m smarticles`."""

import sys

from dem.run.stop import hold


def main() -> int:
    """Run `smarticles` with the arguments of this process; SIGUSR1 waits while modules are imported."""
    hold()
    from smarticles.main import main  # noqa: PLC0415  (takes a fifth of a second)

    return main()


if __name__ == "__main__":
    sys.exit(main())
