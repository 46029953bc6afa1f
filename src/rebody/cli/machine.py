"""What a command needs of the machine beside rebody; asked only once a command has failed."""

import os
import sys
from importlib import import_module


def fault_of_machine() -> str | None:
    """What to do about the setting for graphics or for computing that cannot work here; None where both can."""
    return _fault_of_graphics() or _fault_of_computing()


def _fault_of_graphics() -> str | None:
    """MuJoCo loads what MUJOCO_GL names while it is imported, and fails with errors of its own."""
    chosen = os.environ.get("MUJOCO_GL")
    if not chosen or "mujoco" in sys.modules:
        return None
    try:
        import_module("mujoco")
    except Exception as error:
        return (
            f"MUJOCO_GL={chosen} does not work here ({error}). Unset it, or set it to egl or osmesa (install libegl1 "
            "or libosmesa6), or to glfw where there is a display."
        )
    return None


def _fault_of_computing() -> str | None:
    """JAX takes its devices at the first computation, and may fail without a word."""
    chosen = os.environ.get("JAX_PLATFORMS")
    if not chosen or "jax" not in sys.modules:
        return None
    try:
        import_module("jax").devices()
    except Exception:
        return f"JAX_PLATFORMS={chosen}: JAX has no such device here. Unset it, or set it to cpu."
    return None
