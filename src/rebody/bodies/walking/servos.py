"""Actuators of a model as servos: PD controllers of a joint's position."""

import mujoco
import numpy as np


def is_servo(model: mujoco.MjModel, row: int) -> bool:
    """Whether an actuator pulls its joint towards the position that it is told [rad]."""
    p = model.actuator_gainprm[row, 0]
    return bool(p > 0 and model.actuator_biasprm[row, 1] == -p and model.actuator_gear[row, 0] == 1)


def serve(model: mujoco.MjModel, row: int, p: float, d: float) -> None:
    """Make an actuator a servo of these gains, as strong as it was."""
    if not is_servo(model, row):  # its range is no range of positions
        gear = model.actuator_gear[row, 0]
        if model.actuator_biastype[row] == mujoco.mjtBias.mjBIAS_NONE and model.actuator_ctrllimited[row]:
            strength = gear * model.actuator_gainprm[row, 0] * model.actuator_ctrlrange[row]
            model.actuator_forcerange[row], model.actuator_forcelimited[row] = np.sort(strength), True
        model.actuator_gear[row, 0] = 1.0
        model.actuator_ctrllimited[row] = False
    model.actuator_gaintype[row] = mujoco.mjtGain.mjGAIN_FIXED
    model.actuator_biastype[row] = mujoco.mjtBias.mjBIAS_AFFINE
    model.actuator_gainprm[row, 0] = p
    model.actuator_biasprm[row, :3] = 0.0, -p, -d
