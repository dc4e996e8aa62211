"""Runs for other programs and for a browser: true bodies with their fields, as files, and as a page to look around in."""
