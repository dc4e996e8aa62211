"""A run in a page of the browser, to look around in: a server on this machine, drawing in the page."""
