"""The records of the worked logs, simulated with seeds: what each one is made of is known, so that a reader can compare."""

import numpy as np


def lag(v, a, b, delay=0):
    """The output of b(z)/a(z) with a[0] = 1, from rest, `delay` samples later."""
    y = np.zeros(len(v))
    for n in range(len(v)):
        past = sum(b[j] * v[n - delay - j] for j in range(len(b)) if n - delay - j >= 0)
        y[n] = past - sum(a[j] * y[n - j] for j in range(1, len(a)) if n - j >= 0)
    return y


def dead_zone(u, low=-0.5, high=0.7):
    return np.maximum(u - high, 0) + np.minimum(u - low, 0)


def motor(n=4000, seed=1):
    """A motor with a dead zone: voltage in V, speed in rad/s, every 10 ms; new random voltage at each sample."""
    rng = np.random.default_rng(seed)
    voltage = rng.uniform(-3, 3, n)
    speed = lag(dead_zone(voltage), [1, -0.8], [4.0 * 0.2], delay=1)
    return {"t": 0.01 * np.arange(n), "voltage": voltage, "speed": speed + rng.normal(0, 0.05, n)}


def amplifier(n=4000, seed=2):
    """An amplifier that saturates at -2 and 2.5, before a resonant load."""
    rng = np.random.default_rng(seed)
    u = rng.normal(0, 2, n)
    y = lag(np.clip(u, -2, 2.5), [1, -1.5, 0.7], [0, 0.12, 0.08])
    return {"t": 0.001 * np.arange(n), "command": u, "position": y + rng.normal(0, 0.03, n)}


def converter(n=6000, seed=3):
    """A converter with steps of 0.5, before a filter."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-1.5, 1.5, n)
    y = lag(0.5 * np.round(u / 0.5), [1, -0.6], [0.4])
    return {"t": 1e-4 * np.arange(n), "code": u, "volt": y + rng.normal(0, 0.02, n)}


def sensor_curve(w):
    return 4 / (1 + np.exp(-1.2 * w)) - 2 + 0.15 * w


def sensor(n=5000, seed=4):
    """A heated body with a sensor whose curve bends: linear dynamics, then a static nonlinearity."""
    rng = np.random.default_rng(seed)
    power = rng.normal(0, 1, n)
    temperature = lag(power, [1, -1.2, 0.45], [0, 0.6, 0.2])
    return {"t": 0.5 * np.arange(n), "power": power, "signal": sensor_curve(temperature) + rng.normal(0, 0.02, n)}


def two_valves(n=6000, seed=5):
    """A tank with two inlets: a valve with a dead zone and one that saturates, each with dynamics of its own."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-2, 2, n), rng.uniform(-2, 2, n)
    level = lag(dead_zone(a, -0.4, 0.4), [1, -0.85], [0.15]) + lag(np.tanh(1.5 * b), [1, -0.6], [0, 0.4])
    return {"t": 1.0 * np.arange(n), "valve_a": a, "valve_b": b, "level": level + rng.normal(0, 0.01, n)}


def fan(n=400, seed=6):
    """A curve without dynamics: flow over speed, with a kink, and noise that grows with the speed."""
    rng = np.random.default_rng(seed)
    speed = np.sort(rng.uniform(0, 10, n))
    flow = np.where(speed < 4, 0.1 * speed, 0.4 + 0.5 * (speed - 4)) + rng.normal(0, 0.05 + 0.015 * speed, n)
    return {"speed": speed, "flow": flow}


def fan_curve(speed):
    return np.where(speed < 4, 0.1 * speed, 0.4 + 0.5 * (speed - 4))


def hard_spring(n=6000, seed=7):
    """A mass on a spring that hardens (Duffing): the nonlinearity is in the feedback from position to force."""
    rng = np.random.default_rng(seed)
    h, parts = 0.05, 20
    force, y, position, velocity = rng.normal(0, 2, n), np.zeros(n), 0.0, 0.0
    for k in range(n):
        y[k] = position
        for _ in range(parts):
            velocity += h / parts * (force[k] - 0.4 * velocity - position - 3 * position**3)
            position += h / parts * velocity
    return {"t": h * np.arange(n), "force": force, "position": y + rng.normal(0, 1e-3, n)}


def two_levels(n=3000, seed=8):
    """The motor under a voltage of two levels: no record of this kind shows the dead zone's shape."""
    rng = np.random.default_rng(seed)
    voltage = rng.choice([-2.0, 2.0], n)
    speed = lag(dead_zone(voltage), [1, -0.8], [4.0 * 0.2], delay=1)
    return {"t": 0.01 * np.arange(n), "voltage": voltage, "speed": speed + rng.normal(0, 0.05, n)}


def narrow_start(n=4000, seed=9):
    """The motor under a voltage that is small in the first three quarters of the record, and large in the last; its driver limits it to 2 V."""
    rng = np.random.default_rng(seed)
    voltage = rng.uniform(-1, 1, n) * np.where(np.arange(n) < 0.75 * n, 1.5, 3)
    speed = lag(dead_zone(np.clip(voltage, -2, 2)), [1, -0.8], [4.0 * 0.2], delay=1)
    return {"t": 0.01 * np.arange(n), "voltage": voltage, "speed": speed + rng.normal(0, 0.05, n)}


def raw_motor():
    """The motor's log as an instrument writes it: other units, five seconds of standstill at the start, four lost readings of the encoder."""
    record = motor()
    waiting = 500
    rng = np.random.default_rng(10)
    voltage = np.concatenate([np.zeros(waiting), record["voltage"]])
    speed = np.concatenate([0.02 * rng.normal(size=waiting), record["speed"]])
    speed[[900, 2400, 2401, 4100]] = [4e3, -4e3, -4e3, 4e3]
    return {"Time [ms]": 10.0 * np.arange(len(voltage)), "voltage [mV]": 1000 * voltage, "speed [rpm]": speed * 30 / np.pi}


def joint_log(duration=60.0, rate=100, seed=11, inertia=0.8, viscous=1.2, coulomb=0.6):
    """A rigid joint with Coulomb and viscous friction under a random torque: instants, position, velocity and torque as a driver logs them."""
    rng = np.random.default_rng(seed)
    steps = 20
    h = 1 / (rate * steps)
    n = int(duration * rate)
    torque = np.zeros(n)
    for f in np.arange(0.1, 3.0, 0.1):
        torque += rng.normal(0, 1.2) * np.sin(2 * np.pi * (f * np.arange(n) / rate + rng.uniform()))
    q, v = np.zeros(n), np.zeros(n)
    state = np.zeros(2)
    for k in range(n):
        q[k], v[k] = state
        for _ in range(steps):
            friction = viscous * state[1] + coulomb * np.tanh(state[1] / 0.01)
            state = state + h * np.array([state[1], (torque[k] - friction) / inertia])
    jitter = rng.uniform(-2e-4, 2e-4, n)
    return {"t": np.arange(n) / rate + jitter, "q": q + rng.normal(0, 1e-5, n), "v": v + rng.normal(0, 1e-3, n), "tau": torque}


# Of the drives of a six-joint arm, seen from their links.
DRIVES = {"inertia": [1.2, 1.5, 0.8, 0.2, 0.15, 0.1], "coulomb": [6, 8, 5, 2, 1.5, 1], "viscous": [8, 9, 6, 2, 1.5, 1]}


def robot(reference, chain, seed=3):
    """A log of a robot whose joints follow their references: the positions, and the torques that the links and the drives need."""
    rng = np.random.default_rng(seed)
    t = reference["t"]
    q = np.column_stack([reference[f"r_{joint}"] for joint in chain.joints])
    v = np.gradient(q, t, axis=0)
    a = np.gradient(v, t, axis=0)
    inertia, coulomb, viscous = (np.array(DRIVES[name]) for name in ("inertia", "coulomb", "viscous"))
    tau = chain.inverse_dynamics(q, v, a) + inertia * a + coulomb * np.tanh(v / 0.01) + viscous * v
    log = {"t": t}
    for i in range(q.shape[1]):
        log[f"q{i + 1}"] = q[:, i] + rng.normal(0, 1e-5, t.size)
    for i in range(q.shape[1]):
        log[f"tau{i + 1}"] = tau[:, i] + rng.normal(0, 0.02 * coulomb[i], t.size)
    return log


def fleet_of_joints(template, count=200, seed=13):
    """Arm files of so many joints by key, whose parameters lie anywhere within tolerances. Joint 057 has lost 30 % of its stiffness, and joint 148
    has twice the Coulomb friction."""
    rng = np.random.default_rng(seed)
    head, shoulder, elbow = template.split("[[arm.joint]]")
    for joint in range(count):
        inertia, stiffness, friction = 1 + rng.uniform(-1, 1, 3) * [0.02, 0.05, 0.08]
        stiffness *= 0.7 if joint == 57 else 1
        coulomb = 2.0 * friction * (2 if joint == 148 else 1)
        own = elbow.replace("motor_inertia = 1.0", f"motor_inertia = {inertia}")
        own = own.replace("linear = 500.0", f"linear = {500 * stiffness}")
        own = own.replace("2.0, 100.0, 0.5]", f"{coulomb}, 100.0, {0.5 * friction}]")
        # A motion and a noise of its own.
        yield f"{joint:03d}", "[[arm.joint]]".join([head, shoulder, own]).replace("[noise]", f"seed = {joint}\n\n[noise]\nseed = {joint}")


def write_bag(path, joints):
    """The joints' logs as a bag of ROS 2, `sensor_msgs/JointState`, with a second topic of a battery's voltage: MCAP, or
    `.db3` by its name."""
    import shutil
    import tempfile
    from pathlib import Path

    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    kind = "sensor_msgs/msg/JointState"
    first = next(iter(joints.values()))
    with tempfile.TemporaryDirectory() as folder:
        storage = StoragePlugin.SQLITE3 if path.suffix == ".db3" else StoragePlugin.MCAP
        with Writer(Path(folder) / "bag", version=9, storage_plugin=storage) as writer:
            topic = writer.add_connection("/joint_states", kind, typestore=store)
            battery = writer.add_connection("/battery", "std_msgs/msg/Float64", typestore=store)
            for k, t in enumerate(first["t"]):
                instant = 1_760_000_000_000_000_000 + round(1e9 * t)
                stamp = types["builtin_interfaces/msg/Time"](instant // 10**9, instant % 10**9)
                columns = [np.array([log[name][k] for log in joints.values()]) for name in ("q", "v", "tau")]
                message = types[kind](types["std_msgs/msg/Header"](stamp, "base"), list(joints), *columns)
                writer.write(topic, instant + 100_000, store.serialize_cdr(message, kind))
                if k % 100 == 0:
                    voltage = types["std_msgs/msg/Float64"](48.0 - 1e-5 * k)
                    writer.write(battery, instant + 200_000, store.serialize_cdr(voltage, "std_msgs/msg/Float64"))
        shutil.copy(next((Path(folder) / "bag").glob(f"*{path.suffix}")), path)
