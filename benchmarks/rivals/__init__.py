"""Our engines beside others that could do the same: cost against overlap, from the same poses, in one run."""
