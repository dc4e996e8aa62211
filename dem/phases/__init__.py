"""What happens, one file for each kind of phase."""
