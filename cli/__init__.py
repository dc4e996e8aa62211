"""The console command `smarticles`."""
