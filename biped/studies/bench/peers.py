"""What a user would pick instead, on the two four-bars of Fig 2.5: each with the settings that serve it best.

Every function prepares a simulation and returns a callable that runs it and gives x₃ at the sample times.
"""

import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from biped.dynamics import pattern
from biped.dynamics.mechanisms import four_bars, overconstrained, pendulum, squeezer
from biped.dynamics.mechanisms.four_bars_mjcf import four_bars_mjcf

MOST_SECONDS = 60.0
"""CPU time [s] after which SciPy is stopped: steps collapse at a singular position."""

PROJECTIONS, PROJECTED_TO = 5, 1e-12
"""Newton iterations that put a state of SciPy's onto the constraints, and the correction that ends them [m]."""

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


def ida_stabilised(system: Any, start: tuple[np.ndarray, np.ndarray], rtol: float) -> Callable[[], Any]:
    """SUNDIALS IDA on Gear's stabilised index-2 form of a system: q̇ = v + Aᵀμ, Mv̇ = Q + Aᵀλ, Φ = Φ̇ = 0."""
    from sksundae.ida import IDA

    n, m = system.n, system.m
    M, Q, A = np.zeros((n, n)), np.zeros(n), np.zeros((m, n))
    phi, b_q = np.zeros(m), np.zeros(m)
    mass, force, fill_phi, fill_A, fill_b_q = system.functions[:5]
    p = system.p

    def residual(t, y, yp, res):
        q, v, multiplier, mu = y[:n].copy(), y[n : 2 * n].copy(), y[2 * n : 2 * n + m], y[2 * n + m :]
        for x in (M, Q, A, phi, b_q):
            x[:] = 0.0
        mass(t, q, v, p, M)
        force(t, q, v, p, Q)
        fill_phi(t, q, v, p, phi)
        fill_A(t, q, v, p, A)
        fill_b_q(t, q, v, p, b_q)
        res[:n] = yp[:n] - v - A.T @ mu
        res[n : 2 * n] = M @ yp[n : 2 * n] - Q - A.T @ multiplier
        res[2 * n : 2 * n + m] = A @ v - b_q
        res[2 * n + m :] = phi

    e = system.evaluate(0.0, *start)
    K = np.block([[e.M, -e.A.T], [e.A, np.zeros((m, m))]])
    solved = np.linalg.solve(K, np.concatenate((e.Q, e.b_v)))
    y = np.concatenate((*start, solved[n:], np.zeros(m)))
    yp = np.concatenate((start[1], solved[:n], np.zeros(2 * m)))
    index = np.arange(2 * n, 2 * n + 2 * m)
    tolerance = np.full(y.size, rtol)
    tolerance[index] = 1e6  # no error test on the multipliers, as its authors advise for this index
    solver = IDA(residual, rtol=rtol, atol=tolerance, algebraic_idx=index, max_num_steps=20_000)

    def run() -> np.ndarray:
        solution = solver.solve(TIMES, y, yp)
        if not solution.success:
            raise RuntimeError(f"stopped at t = {solution.t[-1]:.3g} s: {solution.message}")
        return solution.y

    return run


def ida_four_bars(rtol: float) -> Run:
    """SUNDIALS IDA on the four-bars in natural coordinates."""
    run = ida_stabilised(four_bars.four_bars(), four_bars.CONSISTENT, rtol)
    return lambda: run()[:, 4]


def ida_pendulum(rtol: float) -> Run:
    """SUNDIALS IDA on the pendulum."""
    run = ida_stabilised(pendulum.pendulum(), pendulum.CONSISTENT, rtol)
    return lambda: run()[:, :2]


def scipy_index1(
    system: Any, start: tuple[np.ndarray, np.ndarray], rtol: float, times: np.ndarray
) -> Callable[[], Any]:
    """SciPy's DOP853 on the index-1 form, its states put onto the constraints before the forces are asked for.

    Without that a chain leaves the singular position on the wrong branch (Baumgarte's terms at 10/s, any tolerance).
    The whole of [M Aᵀ; A 0] is factored as a band (LAPACK's gbsv), in the order of Cuthill and McKee.
    """
    from scipy.integrate import solve_ivp
    from scipy.linalg.lapack import dgbsv
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    n, m = system.n, system.m
    p, found = system.p, pattern.find(system, times[0], *start)
    M, Q, A, phi, b_q, b_v = (np.zeros(shape) for shape in ((n, n), n, (m, n), m, m, m))
    filled = np.zeros((n + m, n + m), bool)
    filled[:n, :n], filled[:n, n:], filled[n:, :n] = found[0], found[1].T, found[1]
    place = np.argsort(reverse_cuthill_mckee(csr_array(filled), symmetric_mode=True))
    in_M, in_A = np.nonzero(found[0]), np.nonzero(found[1])
    row = np.concatenate((place[in_M[0]], place[n + in_A[0]], place[in_A[1]]))
    column = np.concatenate((place[in_M[1]], place[in_A[1]], place[n + in_A[0]]))
    width = int(np.abs(row - column).max())
    band, at = np.zeros((3 * width + 1, n + m)), (2 * width + row - column, column)
    stop = [np.inf]

    def solve(right: np.ndarray) -> np.ndarray:
        """[M Aᵀ; A 0]⁻¹ right (n + m, k), its first n rows."""
        rows = A[in_A]
        band[:] = 0.0
        band[at] = np.concatenate((M[in_M], rows, rows))
        _, _, x, info = dgbsv(width, width, band, right[np.argsort(place)])
        if info > 0:
            raise RuntimeError("stopped: the constraints are singular to the last digit")
        return x[place[:n]]

    def fill(t: float, q: np.ndarray, v: np.ndarray) -> None:
        for function, out in zip(system.functions[:6], (M, Q, phi, A, b_q, b_v), strict=True):
            out[:] = 0.0
            function(t, q, v, p, out)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        if time.process_time() > stop[0]:
            raise RuntimeError(f"stopped at t = {t:.3g} s of {times[-1]:.3g} s: more than {MOST_SECONDS:g} s")
        q, v = y[:n].copy(), y[n:].copy()
        for _ in range(PROJECTIONS):
            fill(t, q, v)
            right = np.zeros((n + m, 2))
            right[n:, 0], right[n:, 1] = phi, A @ v - b_q
            off = solve(right)
            q, v = q - off[:, 0], v - off[:, 1]
            if np.abs(off[:, 0]).max() < PROJECTED_TO:
                break
        fill(t, q, v)
        return np.concatenate((y[n:], solve(np.concatenate((Q, b_v))[:, None])[:, 0]))

    def run() -> np.ndarray:
        stop[0] = time.process_time() + MOST_SECONDS
        span, y = (times[0], times[-1]), np.concatenate(start)
        solution = solve_ivp(rate, span, y, method="DOP853", rtol=rtol, atol=rtol, t_eval=times)
        if not solution.success:
            raise RuntimeError(f"stopped at t = {solution.t[-1]:.3g} s of {times[-1]:.3g} s: {solution.message}")
        return solution.y.T

    return run


def scipy_chain(linkages: int, rtol: float) -> Run:
    """SciPy on a chain of four-bars in natural coordinates."""
    run = scipy_index1(four_bars.four_bars(linkages), four_bars.start(np.pi / 2, -1.0, linkages), rtol, TIMES)
    return lambda: run()[:, 2 * linkages]


def scipy_squeezer(rtol: float) -> Run:
    """SciPy on Andrews' squeezing mechanism."""
    s = squeezer.squeezer()
    times = np.linspace(0.0, squeezer.DURATION, 11)
    run = scipy_index1(s.plane.system, (s.plane.q, s.plane.v), rtol, times)
    return lambda: s.plane.angle(run()[:, : s.plane.system.n], s.crank)[-1:]
