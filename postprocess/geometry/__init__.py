"""Lines and the space they take: of vertices alone, with no idea of frames and runs."""
