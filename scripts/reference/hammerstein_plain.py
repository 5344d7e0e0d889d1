"""Reference values for the plain Hammerstein identification, by direct sums.

An independent implementation of the same steps at fixed bandwidth, order, delay and lag: kernel
regression (13), cross-covariance, Yule-Walker equations by lstsq, least squares on the impulse
response by SciPy, unit static gain, free-run prediction. The record comes from a linear congruential
generator and a recursion, so that the test makes the very same one.

Run: python3 scripts/reference/hammerstein_plain.py   (needs NumPy and SciPy)
Used by: crates/flexure/tests/hammerstein/oracle.rs
"""

import numpy as np
from scipy.linalg import hankel, svdvals
from scipy.optimize import least_squares
from scipy.signal import lfilter

N, H, ORDER, DELAY, LAG = 600, 0.25, 2, 3, 4


def record():
    state = 12345

    def draw():
        nonlocal state
        state = (1103515245 * state + 12345) % 2**31
        return state >> 16  # 15 bits: the lower ones repeat early

    u = np.array([(draw() % 41 - 20) / 10.0 for _ in range(N)])
    e = np.array([(draw() % 1001 - 500) / 5000.0 for _ in range(N)])
    w = u + 0.25 * u**3
    y = lfilter([0.0, 0.0, 0.0, 1.0, 0.4, 0.1], [1.0, -1.2, 0.52], w) + 7.0 + e
    return u, y


def epanechnikov(t):
    return np.where(np.abs(t) <= 1.0, 1.0 - t * t, 0.0)


def regression(x, y, at):
    k = epanechnikov((np.asarray(at)[:, None] - x[None, :]) / H)
    return (k @ y) / k.sum(axis=1)


def covariance(x, y, lags):
    n = len(x)
    x, y = x - x.mean(), y - y.mean()
    return np.array([(x[: n - j] * y[j:]).sum() / n for j in range(lags + 1)])


def impulse(b, a, n):
    return lfilter(b, a, np.r_[1.0, np.zeros(n - 1)])


u, y = record()
fitted = N - round(0.25 * N)
fu, fy = u[:fitted], y[:fitted]

# The nonlinearity.
at = np.unique(fu)
pairs = fu[: fitted - LAG], fy[LAG:]
m = regression(*pairs, at)
m_at_samples = regression(*pairs, fu)
m_mean = m_at_samples.mean()

# The impulse response: psi = X.
scale = ((m_at_samples - m_mean) * (fu - fu.mean())).mean()
assert scale**2 > 0.25 * m_at_samples.var() * fu.var()
lags = min(1000, fitted // 5) + DELAY
k = covariance(fu, fy, lags) / scale
limit = 2.575829303548901 * np.sqrt(fu.var() * fy.var() / fitted) / abs(scale)
significant = np.nonzero(np.abs(k) > 1.7 * limit)[0]
last = max(significant[-1], DELAY)
memory = min(max(last + (last - DELAY) // 2, DELAY + 4 * ORDER + 4), lags)
response = k[DELAY : memory + 1]

# Its rational form.
rows = np.array([[response[j - i] for i in range(1, ORDER + 1)] for j in range(ORDER + 1, len(response))])
a = np.r_[1.0, np.linalg.lstsq(rows, -response[ORDER + 1 :], rcond=None)[0]]
b = np.array([sum(a[i] * response[j - i] for i in range(j + 1)) for j in range(ORDER + 1)])
split = lambda p: (p[: ORDER + 1], np.r_[1.0, p[ORDER + 1 :]])
solution = least_squares(
    lambda p: impulse(*split(p), len(response)) - response, np.r_[b, a[1:]], xtol=1e-15, ftol=1e-15, gtol=1e-15
)
b, a = split(solution.x)

# Unit static gain, then the free run from the steady state of the mean input.
gain = b.sum() / a.sum()
phi = gain * (m - m_mean) + fy.mean()
b = np.r_[np.zeros(DELAY), b / gain]
w = np.interp(u, at, phi)
predicted = lfilter(b, a, w - w.mean()) + w.mean() * b.sum() / a.sum()
fresh = slice(fitted, N)
error = y[fresh] - predicted[fresh]
fit = 100 * (1 - np.linalg.norm(error) / np.linalg.norm(y[fresh] - y[fresh].mean()))
hankel_size = min(20, len(response) // 2)
singular = svdvals(hankel(response[1 : hankel_size + 1], response[hankel_size : 2 * hankel_size]))


def show(name, values):
    print(f"{name}: [{', '.join(repr(float(v)) for v in np.atleast_1d(values))}]")


print("u[:3], y[:6]:", u[:3], y[:6])
print("memory:", memory)
show("curve x", at[[0, 7, 20, 33, 40]])
show("curve y", phi[[0, 7, 20, 33, 40]])
show("impulse estimate 0..8", k[:9] / gain)
show("impulse limit", limit / gain)
show("b", b)
show("a", a)
show("singular values", singular[:3] )
show("predicted at 0, 100, 450, 599", predicted[[0, 100, 450, 599]])
show("fit percent", fit)
show("rms", np.sqrt((error**2).mean()))
