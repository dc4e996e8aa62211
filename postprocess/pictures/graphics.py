"""What VTK needs of the machine, and how it is kept quiet."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from vtkmodules.vtkCommonCore import vtkLogger

from dem.errors import RunError


def check_graphics() -> None:
    """Complains where VTK, instead of complaining, would end the process by a segmentation fault.

    Raises:
        RunError: There is neither a display nor a library to draw without one.
    """
    if sys.platform != "linux" or os.environ.get("DISPLAY"):
        return
    for library in ("libEGL.so.1", "libOSMesa.so.8"):
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return
    msg = (
        "cannot draw: no display and no libEGL.so.1; apt-get install libegl1 libgl1-mesa-dri, or see smarticles doctor"
    )
    raise RunError(msg)


@contextmanager
def quiet_vtk() -> Iterator[None]:
    """Keeps VTK from warning, on standard error, that there is no display."""
    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
