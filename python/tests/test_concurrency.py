"""Two threads at once, a forked process, an interrupted fit, a failing callback's neighbours: never a crash.

What can end a process by a signal runs in one of its own.
"""

import platform
import subprocess
import sys
import textwrap
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import flexure

_START = """
import os, signal, sys, threading, time, warnings
import sklearn.base  # Imported at the first use otherwise, where the interrupt may reach it.
import numpy as np
import flexure
warnings.simplefilter("ignore", DeprecationWarning)  # os.fork with threads, which this file tests
rng = np.random.default_rng(1)

def record(n):
    u = rng.normal(size=n)
    y = np.convolve(np.tanh(2 * u), [0.5, 0.3, 0.1])[:n] + 0.01 * rng.normal(size=n)
    return u, y
"""


def _process(text):
    done = subprocess.run(
        [sys.executable, "-c", _START + textwrap.dedent(text)], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, f"{done.returncode}: {done.stdout}{done.stderr}"
    return done.stdout


def test_threads_at_once(record):
    parts = [slice(i * 200, i * 200 + 1500) for i in range(4)]
    alone = [flexure.Hammerstein().fit(record.u[p], record.y[p]).to_json() for p in parts]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda p: flexure.Hammerstein().fit(record.u[p], record.y[p]).to_json(), parts))
    assert together == alone


def test_the_lock_is_released():
    """Another thread goes on while a fit runs: it counts further than a fit that held the lock would let it."""
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (20_000, 3))
    y = x.sum(axis=1) + rng.normal(size=len(x))
    counted, done = [0], threading.Event()

    def count():
        while not done.wait(0.001):
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    flexure.KNNRegressor().fit(x, y)
    seen = counted[0]
    done.set()
    thread.join()
    assert seen > 5


_INTERRUPTS = """
def logs(seconds):
    run = ("[run]\\nduration = %g\\nsample_time = 0.002\\n[excitation]\\nkind = 'multisine'\\namplitude = [40.0, 20.0]\\nf_min = 0.05\\nf_max = 3.0\\n"
           "[noise]\\nstd = { tau1 = 0.4, tau2 = 0.2, q1 = 1e-5, q2 = 1e-5, qm1 = 1e-5, qm2 = 1e-5 }\\n") % seconds
    text = flexure.Arm.preset("space-arm").toml
    log = flexure.Arm.from_text(text[: text.index("[run]")] + run).simulate()
    return lambda name: np.column_stack([log[name + "1"], log[name + "2"]])

def busy():
    # Whether any thread works.
    before = time.process_time()
    time.sleep(0.2)
    return time.process_time() - before > 0.02

def interrupted(work):
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    try:
        work()
    except KeyboardInterrupt:
        return True
"""


@pytest.mark.parametrize(
    "work",
    [
        "flexure.Hammerstein().fit(*record(2_000_000))",
        "flexure.Hammerstein(method='plain', nonlinearity='network').fit(*record(500_000))",
        "flexure.Wiener().fit(*record(100_000))",
        "flexure.WienerHammerstein().fit(*record(100_000))",
        "flexure.HammersteinWiener().fit(*record(100_000))",
        "flexure.Auto().fit(*record(100_000))",
        "flexure.Parallel().fit(*record(100_000))",
        "flexure.NARX().fit(*record(100_000))",
        "flexure.Volterra().fit(*record(100_000))",
        "flexure.MultipleInputs().fit(rng.normal(size=(100_000, 3)), rng.normal(size=100_000))",
        "flexure.JointInputs().fit(rng.normal(size=(100_000, 3)), rng.normal(size=100_000))",
        "flexure.identify_joint(log('tau'), motor=log('qm'), link=log('q'), dt=0.002)",
        "flexure.identify_joint(log('tau')[:, 0], position=log('q')[:, 0], dt=0.002)",
        "flexure.KNNRegressor().fit(rng.normal(size=(300_000, 3)), rng.normal(size=300_000))",
        "flexure.KernelRegressor().fit(rng.normal(size=(300_000, 3)), rng.normal(size=300_000))",
        "flexure.KernelRegressor(kernel='gaussian').fit(rng.normal(size=(3_000_000, 1)), rng.normal(size=3_000_000))",
        "flexure.Arm.preset('space-arm').simulate_batch(np.zeros((64, 100_000, 2)))",
    ],
)
def test_an_interrupt_ends_the_work(work):
    """Every one of these takes many seconds. The interrupt is seen at once, and soon no thread works any more."""
    setup = "log = logs(120)" if "log(" in work else ""
    out = _process(
        _INTERRUPTS
        + setup
        + textwrap.dedent(f"""
        work = lambda: {work}
        stopped = interrupted(work)
        begin = time.monotonic()
        while (still := busy()) and time.monotonic() - begin < 5:
            pass
        u, y = record(2000)
        print(stopped, still, flexure.Hammerstein().fit(u, y).verdict_.fit_percent > 90)
        """)
    )
    assert out.split() == ["True", "False", "True"]


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="there is no fork here")
@pytest.mark.parametrize(
    "work",
    [
        "flexure.Hammerstein().fit(*record(2_000_000))",
        "flexure.KNNRegressor().fit(rng.normal(size=(300_000, 3)), rng.normal(size=300_000))",
        "flexure.KernelRegressor(kernel='gaussian').fit(rng.normal(size=(3_000_000, 1)), rng.normal(size=3_000_000))",
        "flexure.identify_joint(log('tau'), motor=log('qm'), link=log('q'), dt=0.002)",
    ],
)
def test_an_interrupt_ends_the_work_of_a_forked_process(work):
    """Also if no progress is reported. Work in another thread of the child goes on to its end."""
    setup = "log = logs(120)" if "log(" in work else ""
    out = _process(
        _INTERRUPTS
        + setup
        + textwrap.dedent(f"""
        u, y = record(2000)
        expected = flexure.Hammerstein().fit(u, y).to_json()
        signal.alarm(200)
        child = os.fork()
        if child == 0:
            beside = []
            def again():
                while not beside or beside[-1] == expected and not ended:
                    beside.append(flexure.Hammerstein().fit(u, y).to_json())
            ended = []
            other = threading.Thread(target=again)
            other.start()
            stopped = interrupted(lambda: {work})
            ended.append(True)
            other.join()
            begin = time.monotonic()
            while (still := busy()) and time.monotonic() - begin < 5:
                pass
            os._exit(0 if stopped and not still and set(beside) == {{expected}} else 3)
        print(os.waitpid(child, 0)[1])
        """)
    )
    assert out.split() == ["0"]


def test_an_interrupted_simulation():
    out = _process("""
        arm = flexure.Arm.from_text(flexure.Arm.preset("space-arm").toml.replace("duration = ", "duration = 100"))
        threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        try:
            arm.simulate()
            print("not interrupted")
        except KeyboardInterrupt:
            print("interrupted")
    """)
    assert out.split() == ["interrupted"]


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="there is no fork here")
def test_a_forked_process_computes(record):
    """The child lacks the threads of the parent's pool, and the grandchild those of the child's pool."""
    out = _process("""
        x = rng.uniform(-1, 1, (30_000, 2))
        y = np.sin(3 * x[:, 0]) + 0.1 * rng.normal(size=len(x))
        at = x[:2000]
        expected = flexure.KernelRegressor(bandwidth=0.3).fit(x, y).predict(at)

        def check():
            got = flexure.KernelRegressor(bandwidth=0.3).fit(x, y).predict(at)
            u, v = record(1500)
            return np.array_equal(got, expected) and flexure.Hammerstein().fit(u, v).verdict_.fit_percent > 90

        signal.alarm(120)  # a child that waits for threads that are not there ends here
        child = os.fork()
        if child == 0:
            grandchild = os.fork()
            if grandchild == 0:
                os._exit(0 if check() else 3)
            ok = os.waitpid(grandchild, 0)[1] == 0
            os._exit(0 if check() and ok else 4)
        print(os.waitpid(child, 0)[1], check())
    """)
    assert out.split() == ["0", "True"]


def test_multiprocessing_by_fork():
    out = _process("""
        import multiprocessing
        u, y = record(3000)
        first = flexure.Hammerstein().fit(u[:1500], y[:1500])
        with multiprocessing.get_context("fork").Pool(2) as pool:
            parts = [(u[:1500], y[:1500]), (u[1500:], y[1500:])]
            models = pool.starmap(flexure.Hammerstein().fit, parts)
        print(models[0].to_json() == first.to_json(), models[1].verdict_.holds)
    """)
    assert out.split() == ["True", "True"]


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_memory_is_kept_between_calls():
    """What one call freed the next one has: the system hands out, and clears, no pages again. Without that it is some ten thousand of them."""
    out = _process("""
        import resource
        x = rng.uniform(-2, 2, (1_000_000, 1))
        y = np.tanh(x[:, 0]) + 0.1 * rng.normal(size=len(x))

        def faults():
            before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
            flexure.KernelRegressor().fit(x, y)
            return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

        print(min(faults() for _ in range(6)))
    """)
    assert int(out) < 2500
