"""Figures 2.1–2.6 and 2.8–2.10 of the thesis, redrawn from our own runs."""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from biped.dynamics import RK4, ConstrainedSystem, Solution, integrate
from biped.dynamics.mechanisms import exercises, four_bars, pendulum, slider_crank

FIG_2_2_STEPS = (5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2)


def draw(folder: Path) -> None:
    """All of them as PNG, named after the thesis's figures."""
    fig_2_1(folder)
    fig_2_2(folder)
    figs_2_3_and_2_4(folder)
    figs_2_5_and_2_6(folder)
    figs_2_8_to_2_10(folder)


def _save(figure: Figure, folder: Path, name: str) -> None:
    figure.savefig(folder / f"{name}.png", dpi=90)
    plt.close(figure)


def fig_2_1(folder: Path) -> None:
    """The last swing of 1000 s: exact, and with an imperfect start with and without correction."""
    options: dict[str, Any] = {"duration": 1000.0, "dt": 1e-3}
    system = pendulum.pendulum()
    ours = integrate(system, *pendulum.INCONSISTENT, **options)
    drifting = integrate(system, *pendulum.INCONSISTENT, scheme=RK4.uncorrected(), **options)
    last = slice(-2400, None, 60)
    exact = pendulum.exact(ours.t[last])
    figure, (path, times) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for x, style, label in (
        (exact, "k.", "exact, perfect start"),
        (ours.q[last], "C0o", "corrected (2.16), imperfect start"),
        (drifting.q[last], "C3+", "uncorrected (2.17), imperfect start"),
    ):
        path.plot(x[:, 0], x[:, 1], style, mfc="none", label=label)
        times.plot(ours.t[last], x[:, 0], style, mfc="none")
    path.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    times.set(xlabel="t [s]", ylabel="x [m]")
    figure.legend(loc="outside upper center", ncols=3)
    _save(figure, folder, "fig_2_1")


def fig_2_2(folder: Path) -> None:
    """Constraint and position errors of the pendulum against the step, for 10 s and 100 s."""
    figure, panels = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
    for duration, line in ((10.0, "--"), (100.0, "-")):
        rows = []
        for dt in FIG_2_2_STEPS:
            r = integrate(pendulum.pendulum(), *pendulum.CONSISTENT, duration=duration, dt=dt)
            alone = integrate(pendulum.trusted(), [0.0], [0.0], duration=duration, dt=dt)
            exact = pendulum.exact(r.t)
            off = [np.linalg.norm(x - exact, axis=1).max() for x in (r.q, pendulum.position(alone.q[:, 0]))]
            rows.append((r.phi.max(), r.phi_dot.max(), *off))
        phi, phi_dot, position, trusted = np.array(rows).T
        label = f"{duration:g} s"
        panels[0].loglog(FIG_2_2_STEPS, phi, "C0o" + line, mfc="none", label=label)
        panels[1].loglog(FIG_2_2_STEPS, phi_dot, "C0o" + line, mfc="none", label=label)
        panels[2].loglog(FIG_2_2_STEPS, position, "C0o" + line, mfc="none", label=f"constrained, {label}")
        panels[2].loglog(FIG_2_2_STEPS, trusted, "k." + line, label=f"one angle, {label}")
    for panel, label in zip(panels, ("max |Φ| [m²]", "max |Φ̇| [m²/s]", "position error [m]"), strict=True):
        panel.set(xlabel="step [s]", ylabel=label)
        panel.grid(alpha=0.3)
        panel.legend()
    _save(figure, folder, "fig_2_2")


def _residuals(system: ConstrainedSystem, r: Solution, every: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """T (K,), |Φ| and |Φ̇| (K, m) of every so many samples."""
    chosen = range(0, len(r.t), every)
    states = [(system.evaluate(r.t[k], r.q[k], r.v[k]), r.v[k]) for k in chosen]
    phi = np.abs([e.phi for e, _ in states])
    phi_dot = np.abs([e.phi_dot(v) for e, v in states])
    return r.t[chosen.start : chosen.stop : chosen.step], phi, phi_dot


def _draw_residuals(figure: Figure, panels: np.ndarray, residuals: tuple, style: str, label: str) -> None:
    t, phi, phi_dot = residuals
    for panel, values in zip(panels, (phi, phi_dot), strict=True):
        for i in range(values.shape[1]):
            # A constraint met exactly has no place on a logarithm: it is drawn at the bottom.
            shown = np.maximum(values[:, i], 1e-32)
            panel.semilogy(t, shown, style, color=f"C{i}", lw=0.7, label=f"{label} {i + 1}")
        panel.set(xlabel="t [s]")
        panel.grid(alpha=0.3)


def figs_2_3_and_2_4(folder: Path) -> None:
    """The slider-crank: one turn from both starts, and its constraints with and without correction."""
    system = slider_crank.slider_crank()
    options: dict[str, Any] = {"duration": 100.0, "dt": 1e-3}
    consistent = integrate(system, *slider_crank.CONSISTENT, **options)
    imperfect = integrate(system, *slider_crank.INCONSISTENT, **options)
    drifting = integrate(system, *slider_crank.INCONSISTENT, scheme=RK4.uncorrected(), **options)
    figure, axes = plt.subplots(figsize=(9, 4.5), layout="constrained")
    for r, style, label in ((consistent, "k-", "consistent start"), (imperfect, "C0--", "imperfect start")):
        for k in range(97_500, 99_001, 75):
            x, y, a, b = r.q[k]
            joints = np.array([[x, y], [x + np.cos(a), y + np.sin(a)]])
            tip = joints[1] + [np.cos(b), np.sin(b)]
            axes.plot(*np.vstack((joints, tip)).T, style, lw=0.9, label=label if k == 97_500 else None)
            axes.plot(*tip, style[:-1].rstrip("-") + "s", ms=3)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="t = 97.5 … 99 s")
    axes.legend(loc="upper right")
    _save(figure, folder, "fig_2_3")
    figure, panels = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    _draw_residuals(figure, panels, _residuals(system, imperfect, 100), "-", "corrected, Φ")
    _draw_residuals(figure, panels, _residuals(system, drifting, 100), "-.", "uncorrected, Φ")
    panels[0].set(ylabel="|Φ| [m]")
    panels[1].set(ylabel="|Φ̇| [m/s]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", fontsize=8)
    _save(figure, folder, "fig_2_4")


def figs_2_5_and_2_6(folder: Path) -> None:
    """Two four-bars: a stretch of motion from both starts, and the constraints of the imperfect one."""
    system = four_bars.four_bars()
    options: dict[str, Any] = {"duration": 100.0, "dt": 1e-2}
    runs = [integrate(system, *start, **options) for start in (four_bars.CONSISTENT, four_bars.INCONSISTENT)]
    figure, axes = plt.subplots(figsize=(9, 4.5), layout="constrained")
    for r, style, label in zip(runs, ("k-", "C0--"), ("consistent start", "imperfect start"), strict=True):
        for k in range(9500, 9626, 25):
            joints = r.q[k].reshape(3, 2)
            axes.plot(*joints.T, style, lw=0.9, label=label if k == 9500 else None)
            for j, joint in enumerate(joints):
                axes.plot([j, joint[0]], [0, joint[1]], style, marker=".", lw=0.9)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="t = 95 … 96.25 s")
    axes.legend(loc="upper right")
    _save(figure, folder, "fig_2_5")
    figure, panels = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    _draw_residuals(figure, panels, _residuals(system, runs[1], 10), "-", "Φ")
    panels[0].set(ylabel="|Φ| [m²]", ylim=(1e-18, 1))
    panels[1].set(ylabel="|Φ̇| [m²/s]", ylim=(1e-18, 1))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", fontsize=8)
    _save(figure, folder, "fig_2_6")


def figs_2_8_to_2_10(folder: Path) -> None:
    """The exercises: the postures of all cycles of 100 s, laid over each other."""
    for number, name in ((1, "fig_2_8"), (2, "fig_2_9"), (3, "fig_2_10")):
        period = round(exercises.PERIODS[number] / 1e-2)
        r = integrate(exercises.exercise(number), exercises.STARTS[number], np.zeros(9), duration=100.0, dt=1e-2)
        figure, axes = plt.subplots(figsize=(5, 5.5), layout="constrained")
        phases = np.linspace(0, period // 2, 6, dtype=int)
        for k, phase in enumerate(phases):
            shade = str(0.75 - 0.75 * k / (len(phases) - 1))
            for at in range(period + phase, len(r.t), period):
                for leg, style in ((0, "-"), (1, "--")):
                    axes.plot(*exercises.outline(r.q[at], leg).T, style, color=shade, lw=1)
        worst = max(r.phi[20:].max(), r.phi_dot[20:].max())
        cycles = round(100.0 / exercises.PERIODS[number])
        axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", ylim=(-0.05, 1.6))
        axes.set_title(f"{cycles} cycles over each other; |Φ|, |Φ̇| ≤ {worst:.2g}", fontsize=10)
        _save(figure, folder, name)
