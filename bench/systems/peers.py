"""One contestant, one fit: `peers.py NAME RECORD FRESH GRID` prints JSON with processor time, output and curve.

The time is that of the fit alone, its compilation included; importing and reading are not counted.
"""

import json
import os
import sys
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NPROC"):
    os.environ[variable] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

import numpy as np  # noqa: E402  (the threads must be set before)


def jax_sysid(u, y, fresh, grid):
    """A Hammerstein model in state space, as its user has to write it: the order of the linear part and the shape of
    the nonlinearity (one hidden layer of ten units) are told, not found."""
    import jax
    import jax.numpy as jnp
    from jax_sysid.models import Model

    jax.config.update("jax_enable_x64", True)
    order, units = 2, 10
    scale = y.std()

    def curve(u, w1, b1, w2):
        return w2 @ jnp.tanh(w1 @ u + b1)

    def state(x, u, params):
        a, b, _, w1, b1, w2 = params
        return a @ x + b * curve(u, w1, b1, w2)

    def output(x, u, params):
        return params[2] @ x

    rng = np.random.default_rng(0)
    start = [
        0.5 * np.eye(order),
        rng.normal(size=order),
        rng.normal(size=(1, order)),
        rng.normal(size=(units, 1)),
        rng.normal(size=units),
        0.3 * rng.normal(size=(1, units)),
    ]

    def work():
        model = Model(order, 1, 1, state_fcn=state, output_fcn=output)
        model.init(params=start, x0=np.zeros(order))
        model.loss(rho_x0=1e-4, rho_th=1e-8, train_x0=True)
        model.optimization(adam_epochs=500, lbfgs_epochs=1000, iprint=-1)
        model.fit((y / scale).reshape(-1, 1), u.reshape(-1, 1))
        return model

    model, seconds = timed(work)
    simulated, _ = model.predict(np.zeros(order), fresh.reshape(-1, 1))
    phi = [float(curve(np.array([g]), *model.params[3:])[0]) for g in grid]
    return seconds, scale * np.asarray(simulated)[:, 0], phi


def sysidentpy(u, y, fresh, grid):
    """A polynomial NARX of the third degree, its terms chosen by FROLS; it has no curve of its own. The lags are told.
    """
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    def work():
        model = FROLS(
            ylag=3,
            xlag=3,
            order_selection=True,
            n_info_values=30,
            info_criteria="bic",
            estimator=LeastSquares(),
            basis_function=Polynomial(degree=3),
        )
        model.fit(X=u.reshape(-1, 1), y=y.reshape(-1, 1))
        return model

    model, seconds = timed(work)
    simulated = model.predict(X=fresh.reshape(-1, 1), y=np.zeros((model.max_lag, 1)))
    return seconds, np.asarray(simulated)[:, 0], None


def timed(work):
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def main():
    name, record, fresh, grid = sys.argv[1:]
    u, y = np.load(record)
    contestant = {"jax-sysid": jax_sysid, "SysIdentPy": sysidentpy}[name]
    seconds, output, phi = contestant(u, y, np.load(fresh), np.load(grid))
    curve = None if phi is None else [float(v) for v in phi]
    print(json.dumps({"seconds": seconds, "output": [float(v) for v in output], "curve": curve}))


main()
