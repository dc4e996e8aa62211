"""The running simulation behind one interface."""
