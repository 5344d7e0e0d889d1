"""Runs what was exported into the folders of argv[2:] by the runtime argv[1], and prints the largest difference from the reference, relative to
the output's largest value. Exits with 77 where the runtime is not installed.

An arm (arm2, arm3) has two inputs, and the eight components of its state as outputs.

A folder has model.py, model.onnx, model2.fmu, model3.fmu, u.bin and y.bin (f64; u sample by sample).
"""

import importlib.util
import math
import struct
import sys
from pathlib import Path

MISSING = 77


def doubles(path):
    data = path.read_bytes()
    return list(struct.unpack(f"<{len(data) // 8}d", data))


def python(folder, u):
    spec = importlib.util.spec_from_file_location("model", folder / "model.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    model = module.model()
    samples = [row[0] for row in u] if model.inputs == 1 else u
    first = model.simulate(samples)
    model.reset()
    assert first[:20] == [model.step(sample) for sample in samples[:20]]
    return first


def onnx(folder, u):
    import numpy as np
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(folder / "model.onnx", options, providers=["CPUExecutionProvider"])
    return session.run(["y"], {"u": np.array(u)})[0].tolist()


def simulated(folder, u, version, outputs, step):
    """An FMU that FMPy has no complaint about, in time."""
    import fmpy
    import numpy as np
    from fmpy.validation import validate_fmu

    path = str(folder / f"model{version}.fmu")
    found = validate_fmu(path)
    assert not found, found
    description = fmpy.read_model_description(path)
    names = [v.name for v in description.modelVariables if v.causality == "input"]
    if not any(v.name == "sample_time" for v in description.modelVariables):
        # A static model takes steps of any length; the multiples of this one are exact, so that FMPy's lines meet the samples.
        step = 0.375
    times = step * np.arange(len(u))
    rows = [(t, *row) for t, row in zip(times, u)]
    signals = np.array(rows, dtype=[("time", np.float64)] + [(name, np.float64) for name in names])
    result = fmpy.simulate_fmu(
        path, start_time=0, stop_time=step * len(u), step_size=step, output_interval=step, input=signals, output=outputs
    )
    assert len(result) == len(u) + 1, len(result)
    return result


def stepped(folder, u, version, step):
    """The output after each step, by calls of the interface: what FMPy's simulation does in a tenth of its time."""
    import fmpy
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave

    path = str(folder / f"model{version}.fmu")
    description = fmpy.read_model_description(path)
    own = {
        "guid": description.guid,
        "unzipDirectory": fmpy.extract(path),
        "modelIdentifier": description.coSimulation.modelIdentifier,
        "instanceName": "model",
    }
    inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
    (output,) = [v.valueReference for v in description.modelVariables if v.causality == "output"]
    slave = FMU2Slave(**own) if version == 2 else FMU3Slave(**own)
    slave.instantiate()
    if version == 2:
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        put, take = slave.setReal, slave.getReal
    else:
        slave.enterInitializationMode(startTime=0.0)
        put, take = slave.setFloat64, slave.getFloat64
    put(inputs, u[0])
    slave.exitInitializationMode()
    found = []
    for k, row in enumerate(u):
        put(inputs, row)
        slave.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)
        found.append(take([output])[0])
    slave.terminate()
    slave.freeInstance()
    return found


# The samples that FMPy simulates itself.
SIMULATED = 500


def fmu(folder, u, version):
    result = simulated(folder, u[:SIMULATED], version, ["y"], 0.01)
    # Before the first step the output is that of the first input; after a step that of the input at its beginning.
    assert result["y"][0] == result["y"][1]
    found = stepped(folder, u, version, 0.01)
    assert found[:SIMULATED] == result["y"][1:].tolist()
    return found


def arm(folder, u, version):
    outputs = ["q1", "q2", "qm1", "qm2", "dq1", "dq2", "dqm1", "dqm2"]
    result = simulated(folder, u, version, outputs, 0.005)
    # The state at the instants of the inputs, row by row.
    return [float(row[name]) for row in result[:-1] for name in outputs]


RUNTIMES = {
    "python": python,
    "onnx": onnx,
    "fmu2": lambda folder, u: fmu(folder, u, 2),
    "fmu3": lambda folder, u: fmu(folder, u, 3),
    "arm2": lambda folder, u: arm(folder, u, 2),
    "arm3": lambda folder, u: arm(folder, u, 3),
}


def difference(found, expected):
    size = max((abs(v) for v in expected if math.isfinite(v)), default=0.0) or 1.0
    assert len(found) == len(expected), (len(found), len(expected))
    largest = 0.0
    for f, e in zip(found, expected):
        if math.isnan(f) != math.isnan(e):
            return math.inf
        if f != e and not math.isnan(f):
            largest = max(largest, abs(f - e) / size)
    return largest


for folder in map(Path, sys.argv[2:]):
    flat, y = doubles(folder / "u.bin"), doubles(folder / "y.bin")
    inputs = 2 if sys.argv[1].startswith("arm") else len(flat) // len(y)
    u = [flat[i : i + inputs] for i in range(0, len(flat), inputs)]
    try:
        found = RUNTIMES[sys.argv[1]](folder, u)
    except ModuleNotFoundError as error:
        print(error)
        sys.exit(MISSING)
    print(difference(found, y), flush=True)
