"""What of a model is drawn."""

import copy

import mujoco
import numpy as np

from rebody.bodies.model import carried_by

DRAWN_GROUPS = 3
"""MuJoCo and its viewers draw geoms of groups below this."""
BONE, BONE_WIDTH = (0.45, 0.45, 0.48, 1.0), 0.35
"""Colour, and width in units of MuJoCo's own lines."""


def top_of(model: mujoco.MjModel, root: int) -> float:
    """How high a body reaches as it is modelled [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    own = carried_by(model, root)[model.geom_bodyid]
    return float(np.max(data.geom_xpos[own, 2] + model.geom_rbound[own], initial=0.0))


def shown(model: mujoco.MjModel, root: int) -> tuple[mujoco.MjModel, bool]:
    """A copy to draw, and whether something of the robot would not have been seen.

    Makers hide shapes for collisions behind meshes for the eye. Where those are not there, such a body is drawn by what
    it collides with, opaque; between bodies without any shape only a skeleton (`mjVIS_AUTOCONNECT`) can be drawn.
    """
    model = copy.copy(model)
    own = carried_by(model, root)[model.geom_bodyid]
    is_seen = (model.geom_group < DRAWN_GROUPS) & (model.geom_rgba[:, 3] > 0)
    bodies = np.unique(model.geom_bodyid[own & is_seen])
    hidden = own & ~is_seen & ~np.isin(model.geom_bodyid, bodies)
    model.geom_group[hidden] = 0
    model.geom_rgba[hidden, 3] = 1.0
    model.vis.rgba.connect[:], model.vis.scale.connect = BONE, BONE_WIDTH
    return model, bool(hidden.any())
