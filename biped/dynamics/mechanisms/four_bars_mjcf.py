"""The four-bar linkages as an MJCF document: slender bars on hinges, loops closed by `<connect>`."""

from biped.dynamics.mechanisms.four_bars import GRAVITY, LENGTH, MASS


def four_bars_mjcf(linkages: int = 2, length: float = LENGTH, mass: float = MASS, gravity: float = GRAVITY) -> str:
    """N linkages: cranks `crank0…N` on the ground, each but the last carrying `coupler0…N−1`.

    All bars point along +x at zero; hinges turn from +x to +z. Upright is crank π/2, coupler −π/2 [rad].
    """
    l, thin = length, 1e-6 * mass * length**2
    inertia = f'mass="{mass!r}" diaginertia="{thin!r} {mass * l * l / 12!r} {mass * l * l / 12!r}"'

    def bar(name: str, at: float, inside: str = "") -> str:
        return (
            f'<body name="{name}" pos="{at!r} 0 0"><joint name="{name}" axis="0 -1 0"/>'
            f'<inertial pos="{l / 2!r} 0 0" {inertia}/>{inside}</body>'
        )

    cranks = [bar(f"crank{j}", j * l, bar(f"coupler{j}", l) if j < linkages else "") for j in range(linkages + 1)]
    connects = [f'<connect body1="coupler{j}" body2="crank{j + 1}" anchor="{l!r} 0 0"/>' for j in range(linkages)]
    # Pinocchio reads one body of the world only, so the cranks share one. Flat, the reference pose closes
    # every loop: coupler j ends at (j + 2)l, where crank j + 1 does.
    return (
        f'<mujoco model="{linkages} four-bars"><compiler angle="radian"/>'
        f'<option gravity="0 0 {-gravity!r}"/>'
        f'<worldbody><body name="ground">{"".join(cranks)}</body></worldbody>'
        f"<equality>{''.join(connects)}</equality></mujoco>"
    )
