"""Laws of contacts, motors and strings, and limits of overlaps, independent of engines."""
