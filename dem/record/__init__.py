"""What a run writes: names, formats, writers and readers."""
