"""Exported models against SciPy's filter of the blocks that the model has. ONNX and FMU need onnxruntime and fmpy, which are no requirement."""

import importlib.util

import flexure
import numpy as np
import pytest
from scipy.signal import lfilter


@pytest.fixture(scope="module")
def expected(fitted):
    """Inputs that leave the range of the data, and the output from the steady state that belongs to the first."""
    u = np.random.default_rng(3).uniform(-3, 3, 10_000)
    x, f = fitted.nonlinearity_.x, fitted.nonlinearity_.y
    # Beyond its points the curve goes on as a straight line.
    w = np.interp(u, x, f)
    for beyond, (i, j) in ((u < x[0], (0, 1)), (u > x[-1], (-1, -2))):
        w[beyond] = f[i] + (f[i] - f[j]) / (x[i] - x[j]) * (u[beyond] - x[i])
    b, a = fitted.linear_.b, fitted.linear_.a
    return u, lfilter(b, a, w - w[0]) + np.sum(b) / np.sum(a) * w[0]


def check(y, expected):
    assert np.max(np.abs(np.asarray(y) - expected)) < 1e-12 * np.max(np.abs(expected))


def test_python(fitted, expected, tmp_path):
    u, y = expected
    (path,) = fitted.export("python", tmp_path / "motor.py")
    assert path == tmp_path / "motor.py"
    spec = importlib.util.spec_from_file_location("motor", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    model = module.motor()
    assert model.sample_time == 0.01
    check(model.simulate(u), y)
    model.reset()
    check([model.step(value) for value in u], y)


def test_onnx(fitted, expected, tmp_path):
    onnxruntime = pytest.importorskip("onnxruntime")
    u, y = expected
    (path,) = fitted.export("onnx", tmp_path, name="motor")
    session = onnxruntime.InferenceSession(path)
    check(session.run(["y"], {"u": u.reshape(-1, 1)})[0], y)


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmu_is_valid(fitted, tmp_path, fmi):
    pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    (path,) = fitted.export("fmu", tmp_path / "motor.fmu", fmi=fmi)
    assert validate_fmu(str(path)) == []


def test_c_and_matlab_are_written(fitted, tmp_path):
    assert fitted.export("c", tmp_path / "motor.c") == [tmp_path / "motor.c", tmp_path / "motor.h"]
    assert "double motor_step(motor_state *state, double u);" in (tmp_path / "motor.h").read_text()
    (path,) = fitted.export("matlab", tmp_path / "motor.m")
    assert path.read_text().startswith("function y = motor(u)")


def test_what_cannot_be_exported_is_refused(fitted, tmp_path):
    with pytest.raises(flexure.ParameterError, match="must be one of c, fmu, onnx, python, matlab"):
        fitted.export("rust", tmp_path)
    with pytest.raises(flexure.ParameterError, match="must be one of 2, 3"):
        fitted.export("fmu", tmp_path, fmi=1)
    with pytest.raises(flexure.FlexureError, match="give another name"):
        fitted.export("c", tmp_path, name="a-b")
    with pytest.raises(flexure.FlexureError, match="must end in"):
        fitted.export("onnx", tmp_path / "motor.txt")
    assert list(tmp_path.iterdir()) == []
