"""Pictures and films of runs: at the top of the package, on measures and report."""
