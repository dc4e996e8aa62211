"""One smarticle and many: geometry, spheres, poses, states. Knows nothing of scenes or engines."""
