"""Write figures and tables to files."""
