"""Many runs through a batch system."""
