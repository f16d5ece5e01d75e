"""Packages that a user would pick instead, on the two four-bars of Fig 2.5, with the settings that serve each best.

Every function prepares a simulation and returns a callable that runs it and gives x₃ at the sample times.
"""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from biped.dynamics.mechanisms import four_bars, overconstrained
from biped.dynamics.mechanisms.four_bars import four_bars_mjcf

Run = Callable[[], np.ndarray]

DURATION = 10.0  # [s]
SAMPLE = 0.1  # [s]
TIMES = SAMPLE * np.arange(round(DURATION / SAMPLE) + 1)


def _joint_start(names: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """q, v of `four_bars.CONSISTENT` in the joints of the MJCF."""
    cranks = np.array(["crank" in name for name in names])
    return np.where(cranks, np.pi / 2, -np.pi / 2), np.where(cranks, -1.0, 1.0)


def mujoco_connect(dt: float) -> Run:
    """MuJoCo: RK4 and `<connect>`, as stiff as its step allows (time constant 2 dt), Newton to 1e-12."""
    import mujoco

    model = _stiff(four_bars_mjcf(), dt)
    data = mujoco.MjData(model)
    crank = model.joint("crank2").qposadr[0]
    q, v = _joint_start([model.joint(i).name for i in range(model.njnt)])

    def run() -> np.ndarray:
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:] = q, v
        x = [2.0 + np.cos(data.qpos[crank])]
        for _ in TIMES[1:]:
            mujoco.mj_step(model, data, nstep=round(SAMPLE / dt))
            x.append(2.0 + np.cos(data.qpos[crank]))
        return np.array(x)

    return run


def mujoco_bricard(dt: float) -> Run:
    """MuJoCo on Bricard's six-bar, from the same file as ours: its energy [J] at every second."""
    import mujoco

    model = _stiff(overconstrained.bricard_mjcf(), dt)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)

    def energy() -> float:
        mujoco.mj_forward(model, data)
        return float(data.energy.sum())

    def run() -> np.ndarray:
        mujoco.mj_resetData(model, data)
        found = [energy()]
        for _ in range(round(DURATION)):
            mujoco.mj_step(model, data, nstep=round(1.0 / dt))
            found.append(energy())
        return np.array(found)

    return run


def _stiff(text: str, dt: float) -> Any:
    """A model whose `<connect>` is as stiff as the step allows."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = dt
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    model.opt.tolerance, model.opt.iterations = 1e-12, 100
    model.eq_solref[:] = 2 * dt, 1.0
    model.eq_solimp[:] = 0.9999, 0.9999, 0.001, 0.5, 2.0
    return model


def pinocchio_proximal(dt: float, linkages: int = 2) -> Run:
    """Pinocchio: `constraintDynamics` in joint coordinates (proximal, 1e-12) under RK4 from Python."""
    import tempfile
    from pathlib import Path

    import pinocchio as pin

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "four_bars.xml")
        path.write_text(four_bars_mjcf(linkages), encoding="utf-8")
        model = pin.buildModelFromMJCF(str(path))
    end = pin.SE3(np.eye(3), np.array([four_bars.LENGTH, 0.0, 0.0]))
    constraints = pin.StdVec_RigidConstraintModel()
    for j in range(linkages):
        coupler, crank = model.getJointId(f"coupler{j}"), model.getJointId(f"crank{j + 1}")
        loop = pin.RigidConstraintModel(
            pin.ContactType.CONTACT_3D, model, coupler, end, crank, end, pin.ReferenceFrame.LOCAL
        )
        loop.m_baumgarte_parameters.Kp = 100.0
        loop.m_baumgarte_parameters.Kd = 20.0
        constraints.append(loop)
    data, parts = model.createData(), pin.StdVec_RigidConstraintData()
    for loop in constraints:
        parts.append(loop.createData())
    pin.initConstraintDynamics(model, data, constraints, parts)
    settings = pin.ProximalSettings(1e-12, 1e-10, 20)
    q0, v0 = _joint_start(list(model.names)[1:])
    crank, tau = model.joints[model.getJointId(f"crank{linkages}")].idx_q, np.zeros(model.nv)

    def acceleration(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return pin.constraintDynamics(model, data, q, v, tau, constraints, parts, settings).copy()

    def run() -> np.ndarray:
        q, v = q0.copy(), v0.copy()
        x = [linkages + np.cos(q[crank])]
        for _ in TIMES[1:]:
            for _ in range(round(SAMPLE / dt)):
                a1 = acceleration(q, v)
                v2 = v + 0.5 * dt * a1
                a2 = acceleration(q + 0.5 * dt * v, v2)
                v3 = v + 0.5 * dt * a2
                a3 = acceleration(q + 0.5 * dt * v2, v3)
                v4 = v + dt * a3
                a4 = acceleration(q + dt * v3, v4)
                q = q + dt / 6 * (v + 2 * v2 + 2 * v3 + v4)
                v = v + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            x.append(linkages + np.cos(q[crank]))
        return np.array(x)

    return run


def exudyn_index3(dt: float) -> Run:
    """Exudyn: planar rigid bodies, revolute joints, its default implicit solver (generalized α, index 3)."""
    import exudyn as exu
    from exudyn.itemInterface import (
        LoadMassProportional,
        MarkerBodyMass,
        MarkerBodyPosition,
        NodeRigidBody2D,
        ObjectGround,
        RevoluteJoint2D,
        RigidBody2D,
        SensorBody,
    )

    l, m = four_bars.LENGTH, four_bars.MASS
    container = exu.SystemContainer()
    system = container.AddSystem()

    def bar(x: float, y: float, angle: float, motion: list[float]) -> Any:
        node = system.AddNode(NodeRigidBody2D(referenceCoordinates=[x, y, angle], initialVelocities=motion))
        body = system.AddObject(RigidBody2D(physicsMass=m, physicsInertia=m * l * l / 12, nodeNumber=node))
        weight = system.AddMarker(MarkerBodyMass(bodyNumber=body))
        load = [0.0, -four_bars.GRAVITY, 0.0]
        system.AddLoad(LoadMassProportional(markerNumber=weight, loadVector=load))
        return body

    def hinge(one: Any, x1: float, two: Any, x2: float) -> None:
        places = ((one, x1), (two, x2))
        markers = [system.AddMarker(MarkerBodyPosition(bodyNumber=b, localPosition=[x, 0.0, 0.0])) for b, x in places]
        system.AddObject(RevoluteJoint2D(markerNumbers=markers))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # names that change between its releases
        ground = system.AddObject(ObjectGround())
        cranks = [bar(j * l, l / 2, np.pi / 2, [0.5, 0.0, -1.0]) for j in range(3)]
        couplers = [bar((j + 0.5) * l, l, 0.0, [1.0, 0.0, 0.0]) for j in range(2)]
        for j, crank in enumerate(cranks):
            hinge(ground, j * l, crank, -l / 2)
        for j, coupler in enumerate(couplers):
            hinge(cranks[j], l / 2, coupler, -l / 2)
            hinge(coupler, l / 2, cranks[j + 1], l / 2)
        place = SensorBody(
            bodyNumber=cranks[2],
            localPosition=[l / 2, 0.0, 0.0],
            storeInternal=True,
            writeToFile=False,
            outputVariableType=exu.OutputVariableType.Position,
        )
        sensor = system.AddSensor(place)
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(DURATION / dt)
        settings.timeIntegration.endTime = DURATION
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = SAMPLE
        settings.displayStatistics = False

    def run() -> np.ndarray:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            system.SolveDynamic(settings)
        return system.GetSensorStoredData(sensor)[:, 1]

    return run
