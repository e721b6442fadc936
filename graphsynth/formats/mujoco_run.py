"""Run an exported model in MuJoCo."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graphsynth.dynamics.model import DynamicModel
from graphsynth.dynamics.start import StartReport, check_start
from graphsynth.formats.exporting import EngineRun, check_settings, finished, load_engine, steps_between
from graphsynth.formats.mjcf import MjcfModel, MujocoSettings, to_mjcf

Array = NDArray[np.float64]


def run_mujoco(
    model: DynamicModel, start: StartReport, times: ArrayLike, settings: MujocoSettings | None = None
) -> EngineRun:
    """Export a model, run it in MuJoCo, give the motion of all links back (estimated).

    Parameters
    ----------
    model : DynamicModel
    start : StartReport
    times : array_like, shape (n,)
        Output times, s; the step must divide them.
    settings : MujocoSettings, optional

    Returns
    -------
    EngineRun
        Status "failed" and NaN from where the engine gave numbers that are not finite or reset itself.

    Raises
    ------
    GeometryError
        A model that MuJoCo cannot run (see :func:`to_mjcf`), a step that does not divide the times.
    GraphsynthError
        MuJoCo is not installed.
    """
    settings = MujocoSettings() if settings is None else settings
    check_settings(settings, MujocoSettings)
    grid, counts = steps_between(times, settings.step)
    check_start(model, start, float(grid[0]))
    export = to_mjcf(model, start, settings)
    mujoco = load_engine("mujoco")
    engine = mujoco.MjModel.from_xml_string(export.xml)
    data = mujoco.MjData(engine)
    mujoco.mj_resetDataKeyframe(engine, data, 0)
    links = model.mechanism.graph.links
    poses, rates = np.full((2, grid.size, links, 3), np.nan)
    seconds, message = 0.0, ""
    # the engine's warnings, which the status tells, stay off the terminal and out of a log file
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        for k in range(grid.size):
            begin = perf_counter()
            if k:
                mujoco.mj_step(engine, data, counts[k] - counts[k - 1])
            seconds += perf_counter() - begin
            time = grid[k] - grid[0] + start.time
            if not (np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()):
                message = f"numbers that are not finite at t = {time:g} s"
            elif abs(data.time - time) > 0.5 * settings.step or data.warning.number.any():  # a reset moves the clock
                message = f"the engine warned or reset itself before t = {time:g} s"
                message += ": the step is too long for the constraints"
            if message:
                break
            poses[k], rates[k] = _state(mujoco, engine, data, export)
    finally:
        mujoco.set_mju_user_warning(before)
    version = mujoco.__version__
    return finished("MuJoCo", version, settings, grid, (poses, rates), message, counts[-1], seconds)


def _state(mujoco: Any, engine: Any, data: Any, export: MjcfModel) -> tuple[Array, Array]:
    """Poses and velocities of the link frames, shape (links, 3) each."""
    mujoco.mj_kinematics(engine, data)
    mujoco.mj_comPos(engine, data)
    mujoco.mj_comVel(engine, data)
    links = export.angles.shape[0]
    pose, rate = np.zeros((2, links, 3))
    pose[:, 2] = export.start.poses[:, 2] + export.angles @ (data.qpos - export.qpos)
    out = np.zeros(6)
    for _, link, _ in export.tree.edges:
        body = mujoco.mj_name2id(engine, mujoco.mjtObj.mjOBJ_BODY, f"link{link}")
        pose[link, :2] = data.xpos[body, :2]
        mujoco.mj_objectVelocity(engine, data, mujoco.mjtObj.mjOBJ_XBODY, body, out, 0)
        rate[link] = out[3], out[4], out[2]
    return pose, rate
