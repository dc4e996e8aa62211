"""Our engines beside others: cost against overlap, from equal poses, in one run."""
