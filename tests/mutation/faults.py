"""Faults that are seeded, one at a time, into a copy of the package: what a slip of the pen would do.

Each is a text that stands once in a file and the wrong text in its place.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One slip."""

    name: str
    place: str
    """Of what kind the code is that has it: model, scheme, start, end, damping, events, engine, exact or analysis."""
    file: str
    """Below the package."""
    right: str
    """Stands once in the file."""
    wrong: str


def _central(name: str, place: str, right: str, wrong: str) -> Fault:
    return Fault(name, place, "schemes/central.py", right, wrong)


FAULTS = (
    # models: signs, factors, missing terms
    Fault(
        "weight with the wrong sign",
        "model",
        "models/pendulum.py",
        '"-(g/L)*sin(theta)"',
        '"(g/L)*sin(theta)"',
    ),
    Fault(
        "weight a thousandth too large",
        "model",
        "models/pendulum.py",
        '"-(g/L)*sin(theta)"',
        '"-1.001*(g/L)*sin(theta)"',
    ),
    Fault(
        "theta in place of its sine",
        "model",
        "models/pendulum.py",
        '"-(g/L)*sin(theta)"',
        '"-(g/L)*theta"',
    ),
    Fault(
        "length and gravity exchanged",
        "model",
        "models/pendulum.py",
        '"-(g/L)*sin(theta)"',
        '"-(L/g)*sin(theta)"',
    ),
    Fault(
        "noise of a few units in the last place",
        "model",
        "models/pendulum.py",
        '"-(g/L)*sin(theta)"',
        '"-(g/L)*sin(theta) + 2e-15*sin(1e9*theta)"',
    ),
    Fault(
        "length not squared in the kinetic energy",
        "model",
        "models/pendulum.py",
        '"0.5*m*(L*omega)**2"',
        '"0.5*m*L*omega**2"',
    ),
    Fault(
        "half of the potential energy",
        "model",
        "models/pendulum.py",
        '"2.0*m*g*L*sin(0.5*theta)**2"',
        '"m*g*L*sin(0.5*theta)**2"',
    ),
    Fault("frequency not squared", "model", "models/spring.py", '"-w**2*u"', '"-w*u"'),
    Fault(
        "gravity of the elastic pendulum a part too small",
        "model",
        "models/elastic_pendulum.py",
        "(1.0 - y)/{LENGTH} - 1.0)",
        "(1.0 - y)/{LENGTH} - 0.99)",
    ),
    Fault(
        "drag of the elastic pendulum in the old scale",
        "model",
        "models/elastic_pendulum.py",
        '" - (gamma/beta)*{SPEED}*{name}"',
        '" - gamma*{SPEED}*{name}"',
    ),
    Fault(
        "unbalance without the square of the speed",
        "model",
        "models/washing_machine.py",
        '"unbalance*speed**2*cos(speed*t)"',
        '"unbalance*speed*cos(speed*t)"',
    ),
    Fault(
        "mass not divided by",
        "model",
        "models/shared/mechanical.py",
        "inverse = ONE / self.mass",
        "inverse = self.mass",
    ),
    # damping terms
    Fault(
        "drag that does not turn with the velocity",
        "damping",
        "models/pendulum.py",
        '"-drag*abs(omega)*omega + ({WEIGHT})"',
        '"-drag*omega*omega + ({WEIGHT})"',
    ),
    Fault(
        "half of the power of the drag",
        "damping",
        "models/pendulum.py",
        '"m*L**2*drag*abs(omega)*omega**2"',
        '"0.5*m*L**2*drag*abs(omega)*omega**2"',
    ),
    _central(
        "linear damping twice as implicit",
        "damping",
        "(1.0 + 0.5 * dt * rate)",
        "(1.0 + dt * rate)",
    ),
    _central(
        "linear damping at the old time",
        "damping",
        "(push - rate * dt * d) / (1.0 + 0.5 * dt * rate)",
        "(push - rate * dt * d)",
    ),
    _central(
        "geometric mean without its denominator",
        "damping",
        "(push - share * d) / (1.0 + share)",
        "(push - share * d)",
    ),
    _central(
        "sign of the velocity lost in the root",
        "damping",
        "0.25 * rate * abs(both) * both",
        "0.25 * rate * both * both",
    ),
    # schemes: weights, nodes, time levels
    Fault(
        "a weight of RK4",
        "scheme",
        "schemes/runge_kutta.py",
        '("1/6", "1/3", "1/3", "1/6")',
        '("1/6", "1/3", "1/3", "1/5")',
    ),
    Fault(
        "two weights of RK4 exchanged",
        "scheme",
        "schemes/runge_kutta.py",
        '("1/6", "1/3", "1/3", "1/6")',
        '("1/3", "1/6", "1/3", "1/6")',
    ),
    Fault(
        "force of a stage at the old time",
        "scheme",
        "schemes/runge_kutta.py",
        "t + C_{i} * dt",
        "t",
    ),
    Fault(
        "velocity of a stage forgotten",
        "scheme",
        "schemes/runge_kutta.py",
        'f"v_{i} = v + dt * ({kick})"',
        'f"v_{i} = v"',
    ),
    Fault(
        "a weight of AB2", "scheme", "schemes/multistep.py", '("3/2", "-1/2")', '("3/2", "-1/3")'
    ),
    Fault(
        "sign in AB3",
        "scheme",
        "schemes/multistep.py",
        '("23/12", "-4/3", "5/12")',
        '("23/12", "-4/3", "-5/12")',
    ),
    Fault(
        "part of BDF2", "scheme", "schemes/implicit.py", "part = 2.0 * dt / 3.0", "part = dt / 2.0"
    ),
    Fault(
        "Crank-Nicolson without half of its kick",
        "scheme",
        "schemes/implicit.py",
        "u + dt * (v + 0.5 * kick)",
        "u + dt * v",
    ),
    Fault(
        "Crank-Nicolson with the force at the old time",
        "scheme",
        "schemes/implicit.py",
        "half * half, push, half, t + dt, p",
        "half * half, push, half, t, p",
    ),
    Fault(
        "Newmark with a half in place of 1/2 - beta",
        "scheme",
        "schemes/newmark.py",
        '"NEAR": f"1/2 - ({beta})"',
        '"NEAR": f"1/2"',
    ),
    Fault(
        "sign of Yoshida's middle step",
        "scheme",
        "schemes/composition.py",
        '_INNER = "-2**(1/3)',
        '_INNER = "2**(1/3)',
    ),
    Fault(
        "digits of PEFRL exchanged",
        "scheme",
        "schemes/composition.py",
        "0.1786178958448091",
        "0.1786179858448091",
    ),
    Fault(
        "a weight of the Nystrom method",
        "scheme",
        "schemes/runge_kutta.py",
        'velocity=("1/6", "2/3", "1/6")',
        'velocity=("1/6", "1/3", "1/2")',
    ),
    Fault(
        "a coefficient of the Gauss method",
        "scheme",
        "schemes/implicit.py",
        '"A_12": "1/4 - sqrt(3)/6"',
        '"A_12": "1/4 - sqrt(3)/7"',
    ),
    Fault(
        "Newton's method ended at 1e-4",
        "scheme",
        "schemes/newton.py",
        "TOLERANCE = 2.0**-51",
        "TOLERANCE = 1e-4",
    ),
    _central(
        "increment rounded in single precision",
        "scheme",
        "    part = d_ahead - d\n",
        "    d_ahead = (d_ahead + 536870912.0 * d_ahead) - 536870912.0 * d_ahead\n    part = d_ahead - d\n",
    ),
    _central(
        "rounding errors of the sum dropped",
        "scheme",
        "    drift = d_ahead + u_rest\n",
        "    drift = d_ahead\n",
    ),
    # starts and ends
    Fault(
        "first step without its half",
        "start",
        "schemes/central.py",
        "kick = first_kick(variant, u, v, dt, p, acceleration)\n    push = dt * v",
        "kick = 2.0 * first_kick(variant, u, v, dt, p, acceleration)\n    push = dt * v",
    ),
    Fault(
        "first step of first order",
        "start",
        "schemes/central.py",
        "kick = first_kick(variant, u, v, dt, p, acceleration)\n    push",
        "kick = 0.0\n    push",
    ),
    Fault(
        "start of Euler-Cromer exchanged",
        "start",
        "schemes/composition.py",
        "part = 0.5 * dt if variant else dt",
        "part = dt if variant else 0.5 * dt",
    ),
    Fault(
        "a number in the start of AB3",
        "start",
        "schemes/multistep.py",
        "- 23.0 * v_1",
        "- 22.0 * v_1",
    ),
    Fault(
        "velocity at the end one step late",
        "end",
        "engine/gather.py",
        "return 2.0 * v_before - v_two_before",
        "return v_before",
    ),
    Fault(
        "velocity of the increment form one-sided",
        "end",
        "schemes/central.py",
        "return (u + d_ahead, d_ahead), (d + d_ahead) * (0.5 / dt)",
        "return (u + d_ahead, d_ahead), d_ahead / dt",
    ),
    # events
    Fault(
        "ball bounces with its speed squared",
        "events",
        "engine/impact.py",
        "speed = restitution * abs(v)",
        "speed = restitution * abs(v) * abs(v)",
    ),
    Fault(
        "friction that holds twice too little",
        "events",
        "engine/friction.py",
        "return limit(u, 0.0, t, p) - abs(drive(u, 0.0, t, p))",
        "return 0.5 * limit(u, 0.0, t, p) - abs(drive(u, 0.0, t, p))",
    ),
    # engine and simulation
    Fault(
        "time one step early",
        "engine",
        "engine/member_loop.py",
        "            t = n * h\n",
        "            t = (n - 1) * h\n",
    ),
    Fault(
        "wrong step",
        "engine",
        "simulation/solution.py",
        "initial[where], group.end[where] / steps",
        "initial[where], group.end[where] / (steps + 1)",
    ),
    Fault(
        "step in single precision",
        "engine",
        "simulation/solution.py",
        "initial[where], group.end[where] / steps",
        "initial[where], (group.end[where] / steps).astype(np.float32).astype(float)",
    ),
    Fault(
        "samples taken one step late",
        "engine",
        "engine/member_loop.py",
        "        due = every\n",
        "        due = every - 1 if every > 1 else 1\n",
    ),
    Fault(
        "work of forces without half the ends",
        "engine",
        "simulation/derived.py",
        "ends = 0.5 * (power + power[:, :1])",
        "ends = 0.5 * power",
    ),
    # exact solutions
    Fault(
        "exact solution without its frequency",
        "exact",
        "models/shared/linear_motion.py",
        "u_0 * cos + v_0 / w * sin",
        "u_0 * cos + v_0 * sin",
    ),
    Fault(
        "exact solution at other times",
        "exact",
        "simulation/level.py",
        "number * (group.end / steps)[:, None])",
        "number * (group.end / (steps + 1))[:, None])",
    ),
    # analysis
    Fault(
        "common grid off by one",
        "analysis",
        "observe/common_grid.py",
        "laid_out(record[name][..., : (len(grid.t) - 1) * stride + 1 : stride])",
        "laid_out(np.roll(record[name], 1, axis=-1)[..., : (len(grid.t) - 1) * stride + 1 : stride])",
    ),
    Fault(
        "stride of the next level",
        "analysis",
        "observe/common_grid.py",
        'return grid.strides[grid.levels.index(record.whole("level"))]',
        "return grid.strides[0]",
    ),
    Fault(
        "fine minus coarse",
        "analysis",
        "comparison/quantity_comparison.py",
        "results = [coarse - fine for coarse, fine",
        "results = [fine - coarse for coarse, fine",
    ),
    Fault(
        "level minus exact",
        "analysis",
        "comparison/quantity_comparison.py",
        "[self.exact - u for u in self.values]",
        "[u - self.exact for u in self.values]",
    ),
    Fault(
        "norm without its root",
        "analysis",
        "convergence/differences.py",
        "return np.asarray(np.sqrt(spacing * total(error * error)))",
        "return np.asarray(spacing * total(error * error))",
    ),
    Fault(
        "norm without the step",
        "analysis",
        "convergence/differences.py",
        "return np.asarray(np.sqrt(spacing * total(error * error)))",
        "return np.asarray(np.sqrt(total(error * error)))",
    ),
)
