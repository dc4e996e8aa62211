from synthetic.fixtures import make_run, run, scene, shape, write_frame

__all__ = ["make_run", "run", "scene", "shape", "write_frame"]
