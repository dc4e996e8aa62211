"""Effects, time steps and cost of a run, known before it begins."""
