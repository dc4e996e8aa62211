"""Read sweep files, make their points, and keep the directory of a sweep."""
