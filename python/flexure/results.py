"""What an identification found: blocks, and whether the model holds."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from flexure._core import DataError, ParameterError

__all__ = [
    "Branch",
    "Candidate",
    "Comparison",
    "Estimate",
    "FormTest",
    "LinearPart",
    "Nonlinearity",
    "ResidualTest",
    "Surface",
    "Verdict",
]

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]


def _array(values: Any) -> Array:
    return np.array(values, dtype=np.float64)


def frame(columns: dict[str, Any], library: str) -> Any:
    """Columns as a frame of "pandas" or "polars", both optional dependencies."""
    if library == "pandas":
        import pandas

        return pandas.DataFrame(columns)
    if library == "polars":
        import polars

        return polars.DataFrame(columns)
    raise ParameterError(f"the library is {library!r}, but must be pandas or polars")


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error."""

    value: float
    """In SI units, or in the unit of the signals."""
    error: float
    """Its standard error, in the same unit; 0 for a number that was given, NaN where none is known."""

    def __str__(self) -> str:
        return f"{self.value:.4g} ± {self.error:.2g}" if self.error > 0 else f"{self.value:.4g}"


@dataclass(frozen=True)
class FormTest:
    """A physical form that was fitted to a nonlinearity, and its test."""

    name: str
    """For example "dead-zone"."""
    parameters: dict[str, Estimate]
    """The parameters by their names."""
    statistic: float
    """How far the form is from the free nonlinearity."""
    degrees_of_freedom: float
    """The degrees of freedom of its distribution if the form holds."""
    limit: float
    """The value above which the form is refuted."""
    p_value: float
    """The probability of a larger value where the form holds."""
    holds: bool
    """Whether it stayed below."""

    @classmethod
    def of(cls, found: dict[str, Any]) -> FormTest:
        """From the object that ``flexure identify --json`` prints."""
        parameters = {p["name"]: Estimate(p["value"], np.nan if p["error"] is None else p["error"]) for p in found["parameters"]}
        rest = {name: found[name] for name in ("statistic", "degrees_of_freedom", "limit", "p_value", "holds")}
        return cls(found["name"], parameters, **rest)


@dataclass(frozen=True)
class Candidate:
    """One of the structures that were compared."""

    structure: str
    """Its name."""
    fit_percent: float
    """The fit of its free run on fresh samples."""
    rms: float
    """The root mean square of that run's error, in the unit of the output."""
    parameters: int
    """The number of its parameters."""
    verdict: str
    """Remarks on it, in sentences."""
    refuted_by: tuple[dict[str, Any], ...] = field(default=(), repr=False)
    """The tests that refute it, and the comparisons with better ones."""

    @property
    def refuted(self) -> bool:
        """Whether anything refutes it."""
        return len(self.refuted_by) > 0


@dataclass(frozen=True)
class Comparison:
    """What the data say about the structures that were compared."""

    supported: bool
    """Whether the data support the best structure; if not, they support none of those compared."""
    best: str
    """The structure of the model that was kept."""
    as_good: tuple[str, ...]
    """Those that are as good."""
    reasons: tuple[str, ...]
    """Why, in sentences."""
    candidates: tuple[Candidate, ...] = field(repr=False)
    """All that were compared."""
    looks_like: dict[str, float] = field(default_factory=dict)
    """Where none is supported: what the error looks like ("loop", "drift", "hysteresis", "outliers"), with shares of its square."""

    def __str__(self) -> str:
        return " ".join(self.reasons)

    def to_frame(self, library: str = "pandas") -> Any:
        """The structures, one a row, as a frame of "pandas" or "polars"."""
        names = ["structure", "fit_percent", "rms", "parameters", "refuted"]
        return frame({name: [getattr(candidate, name) for candidate in self.candidates] for name in names}, library)

    @classmethod
    def of(cls, found: dict[str, Any]) -> Comparison:
        """From the object that ``flexure identify --json`` prints."""
        names = ("structure", "fit_percent", "rms", "parameters", "verdict")
        candidates = tuple(
            Candidate(**{name: c[name] for name in names}, refuted_by=tuple(c["refuted_by"])) for c in found["candidates"]
        )
        looks_like = {like["kind"]: like["share"] for like in found["looks_like"]}
        return cls(found["supported"], found["best"], tuple(found["as_good"]), tuple(found["reasons"]), candidates, looks_like)


@dataclass(frozen=True, eq=False)
class Nonlinearity:
    """A static nonlinearity, piecewise linear between tabulated points; call it to evaluate it."""

    x: Array
    """Abscissas, increasing, in the unit of what enters it."""
    y: Array
    """Ordinates, in the unit that the convention for the scale gives them."""
    lower: Array | None = None
    """The lower edge of the pointwise 95 % band at `x`; None where there is none."""
    upper: Array | None = None
    """The upper edge."""
    breakpoints: tuple[tuple[float, str], ...] = ()
    """Where it breaks, with "jump", "kink" or "knot"."""
    outside: str = "nearest"
    """Beyond its points: held at its end ("nearest"), the straight continuation ("linear"), or "nan"."""
    kink_errors: Array | None = None
    """Standard errors of the places of the kinks among `breakpoints`, NaN where one is not known; None where there are none."""
    undetermined: tuple[tuple[float, float], ...] = ()
    """Ranges of a joint's curve that the data hardly determine: plots leave them out."""

    def __call__(self, at: npt.ArrayLike) -> Array:
        """Its values; of the shape of `at`."""
        at = np.asarray(at, dtype=np.float64)
        values = np.interp(at, self.x, self.y)
        if self.outside == "nan":
            return np.where((at < self.x[0]) | (at > self.x[-1]), np.nan, values)
        if self.outside == "linear" and len(self.x) > 1:
            for end, other, beyond in ((0, 1, at < self.x[0]), (-1, -2, at > self.x[-1])):
                slope = (self.y[end] - self.y[other]) / (self.x[end] - self.x[other])
                values = np.where(beyond, self.y[end] + slope * (at - self.x[end]), values)
        return np.asarray(values)

    def __repr__(self) -> str:
        breaks = "".join(f", {kind} at {at:.4g}" for at, kind in self.breakpoints)
        band = "" if self.lower is None else ", with a band"
        return f"<Nonlinearity on [{self.x[0]:.4g}, {self.x[-1]:.4g}], {len(self.x)} points{breaks}{band}>"

    def to_frame(self, library: str = "pandas") -> Any:
        """The columns ``x, y`` and, with a band, ``lower, upper``, as a frame of "pandas" or "polars"."""
        columns = {"x": self.x, "y": self.y, "lower": self.lower, "upper": self.upper}
        return frame({name: values for name, values in columns.items() if values is not None}, library)

    @classmethod
    def of(cls, curve: dict[str, Any], breakpoints: Any = (), kinks: Any = ()) -> Nonlinearity:
        """From the object that a model file or a result has."""
        named = [b for b in breakpoints if isinstance(b, dict)]
        places = [(b["at"], b["kind"]) for b in named] or [(at, "knot") for at in breakpoints]
        places = sorted(places + [(at, "kink") for at in kinks])
        errors = curve.get("kink_errors") or [b.get("error") for b in named if b["kind"] == "kink"]
        edge = {k: _array(curve[k]) for k in ("lower", "upper") if len(curve.get(k) or ())}
        return cls(
            _array(curve["x"]),
            _array(curve["y"]),
            breakpoints=tuple(places),
            outside=curve.get("outside", "nearest"),
            kink_errors=_array(errors) if len(errors) else None,
            undetermined=tuple((low, high) for low, high in curve.get("undetermined", ())),
            **edge,
        )


@dataclass(frozen=True, eq=False)
class Surface:
    """A static nonlinearity of several inputs: a tensor product of cubic B-splines over a box; call it to evaluate it."""

    axes: tuple[tuple[float, float, int], ...]
    """For each input: the lower end, the upper end, and the number of pieces between them."""
    coefficients: Array
    """The coefficients of the products of B-splines, pieces + 3 along every axis."""

    def __call__(self, at: npt.ArrayLike) -> Array:
        """Its values at points of shape (..., m), of shape (...); beyond the box those of its nearest point."""
        points = np.asarray(at, dtype=np.float64)
        if points.shape[-1:] != (len(self.axes),):
            raise DataError(f"the points have the shape {points.shape}, but {len(self.axes)} inputs need (..., {len(self.axes)})")
        values = self.coefficients
        flat = points.reshape(-1, len(self.axes))
        for i, (low, high, pieces) in enumerate(self.axes):
            splines = _splines((flat[:, i] - low) / (high - low) * pieces, pieces)
            # The first axis meets each point's own row; later ones one coefficient a point.
            values = np.einsum("nk,k...->n...", splines, values) if i == 0 else np.einsum("nk,nk...->n...", splines, values)
        return np.asarray(values.reshape(points.shape[:-1]))

    def grid(self, points: int = 60) -> tuple[list[Array], Array]:
        """Abscissas of the first two inputs and the values over them, of shape (points, points); others at their middles."""
        middle = [0.5 * (low + high) for low, high, _ in self.axes]
        across = [np.linspace(low, high, points) for low, high, _ in self.axes[:2]]
        at = np.tile(np.array(middle), (points, points, 1))
        at[..., 0], at[..., 1] = np.meshgrid(*across, indexing="ij")
        return across, self(at)

    @classmethod
    def of(cls, surface: dict[str, Any]) -> Surface:
        """From the object that a model file or a result has."""
        axes = tuple((axis["low"], axis["high"], axis["pieces"]) for axis in surface["axes"])
        return cls(axes, _array(surface["coefficients"]).reshape([pieces + 3 for *_, pieces in axes]))


def _splines(place: Array, pieces: int) -> Array:
    """The values of all cubic B-splines along an axis at places from 0 to `pieces`, held within."""
    place = np.clip(place, 0.0, pieces)
    first = np.minimum(place.astype(int), pieces - 1)
    t = place - first
    s = 1.0 - t
    values = np.zeros((len(place), pieces + 3))
    four = (s**3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6)
    for k, value in enumerate(four):
        values[np.arange(len(place)), first + k] = value
    return values


@dataclass(frozen=True, eq=False)
class LinearPart:
    """A linear, time-invariant, discrete-time system b(z)/a(z) in powers of 1/z, a[0] = 1; always stable."""

    b: Array
    """Numerator; the delay is its leading zeros."""
    a: Array
    """Denominator."""
    dt: float | None = None
    """Sample time, s; None where it is not known."""
    b_errors: Array | None = None
    """Standard errors of `b`, zero for what is given; None where there are none."""
    a_errors: Array | None = None
    """Standard errors of `a`."""

    @property
    def order(self) -> int:
        """The number of poles."""
        return len(self.a) - 1

    @property
    def delay(self) -> int:
        """Samples by which it delays."""
        nonzero = np.flatnonzero(self.b)
        return int(nonzero[0]) if len(nonzero) else 0

    @property
    def poles(self) -> ComplexArray:
        """The poles that are not zero."""
        return np.roots(self.a).astype(np.complex128)

    @property
    def zeros(self) -> ComplexArray:
        """The zeros of the numerator without the delay."""
        return np.roots(self.b).astype(np.complex128)

    @property
    def static_gain(self) -> float:
        """The response to a constant 1."""
        return float(np.sum(self.b) / np.sum(self.a))

    def frequency_response(self, omega: npt.ArrayLike) -> ComplexArray:
        """The response at angular frequencies in rad/s (rad a sample where the sample time is not known)."""
        z = np.exp(-1j * np.asarray(omega, dtype=np.float64) * (self.dt or 1.0))
        return np.asarray(np.polyval(self.b[::-1], z) / np.polyval(self.a[::-1], z))

    def impulse_response(self, n: int) -> Array:
        """Its first `n` values."""
        response = np.zeros(n)
        for i in range(n):
            past = min(i, self.order)
            response[i] = (self.b[i] if i < len(self.b) else 0.0) - self.a[1 : past + 1] @ response[i - past : i][::-1]
        return response

    def to_control(self, form: str = "tf") -> Any:
        """As python-control's ``TransferFunction`` (``form="tf"``) or ``StateSpace`` (``form="ss"``)."""
        import control  # an optional dependency

        if form not in ("tf", "ss"):
            raise ParameterError(f"the form is {form!r}, but must be 'tf' or 'ss'")
        size = max(len(self.b), len(self.a))
        b, a = (np.pad(c, (0, size - len(c))) for c in (self.b, self.a))
        dt = True if self.dt is None else self.dt
        return control.tf(b, a, dt) if form == "tf" else control.ss(*_companion(b, a), dt)

    @classmethod
    def of(cls, block: dict[str, Any], dt: float | None) -> LinearPart:
        """From the object that a model file or a result has."""
        errors = {k: _array(block[k]) for k in ("b_errors", "a_errors") if block.get(k) is not None}
        return cls(_array(block["b"]), _array(block["a"]), dt, **errors)


def _companion(b: Array, a: Array) -> tuple[Array, Array, Array, Array]:
    """The controllable canonical form of b(z)/a(z), both of one length and in powers of 1/z."""
    n = len(a) - 1
    A = np.eye(n, k=-1)
    A[:1] = -a[1:]
    B = np.zeros((n, 1))
    B[:1] = 1.0
    return A, B, (b[1:] - b[0] * a[1:]).reshape(1, n), np.array([[b[0]]])


Block = Nonlinearity | Surface | LinearPart


def block_of(found: Any, dt: float | None, breakpoints: Any = ()) -> Block | None:
    """The block out of the object that a model file or a result has for it; None for anything else."""
    if not isinstance(found, dict):
        return None
    if "axes" in found and "coefficients" in found:
        return Surface.of(found)
    if "x" in found and "y" in found:
        return Nonlinearity.of(found, found.get("breakpoints") or breakpoints, found.get("kinks") or ())
    if "b" in found and "a" in found:
        return LinearPart.of(found, dt)
    return None


@dataclass(frozen=True, eq=False)
class Branch:
    """One of the cascades whose outputs add up."""

    nonlinearity: Nonlinearity | None = None
    """Its static nonlinearity."""
    linear: LinearPart | None = None
    """The dynamics after it, where there are none before it."""
    front: LinearPart | None = None
    """The dynamics before it."""
    back: LinearPart | None = None
    """Those after it, where there are some before it."""
    input: str | None = None
    """The input that enters it."""
    _blocks: tuple[tuple[str, Block], ...] = field(default=(), repr=False)

    @property
    def blocks(self) -> list[tuple[str, Block]]:
        """The blocks with their names, in the signal's order."""
        return list(self._blocks)

    @classmethod
    def of(cls, blocks: list[tuple[str, Block]], input: str) -> Branch:
        """A branch of blocks in series, with their names."""
        named: dict[str, Any] = {name: block for name, block in blocks if name in ("nonlinearity", "linear", "front", "back")}
        return cls(**named, input=input, _blocks=tuple(blocks))


@dataclass(frozen=True)
class ResidualTest:
    """A test of the residual on samples that were not used for the fit."""

    name: str
    """The question of the test."""
    statistic: float
    """Its value."""
    degrees_of_freedom: float
    """The degrees of freedom of its distribution if the model holds."""
    limit: float
    """The value above which it fails at its level."""
    p_value: float
    """The probability of a larger value where the model holds."""
    level: float
    """Its share of the joint level of 1 %: a seventh, for each of the seven tests that can refute a model of one input, and for the test of missed
    dynamics in addition."""
    effect: float
    """The size of the effect that it finds: the share of the error's variance that it explains, minus the share by chance."""
    passed: bool
    """Whether it stayed below."""
    refutes: bool
    """Whether a failure refutes the model, and not only the assumption of white noise."""


@dataclass(frozen=True)
class Verdict:
    """How well a model does on samples that were not used for the fit, and whether they refute it."""

    holds: bool
    """Whether no test refutes the model, or only for a misfit below 1 % of the output's standard deviation; and its error is white or
    small."""
    text: str
    """The verdict in sentences."""
    fit_percent: float
    """``100 (1 - |y - yh| / |y - mean y|)`` of the free run."""
    rms: float
    """The root mean square of the free run's error, in the unit of y."""
    r_squared: float
    """``1 - |y - yh|² / |y - mean y|²``."""
    misfit: float = 0.0
    """The size of the part of the error that depends on the input, as a share of the output's standard deviation; 0 where no test
    refutes the model, NaN where its simulated output runs away."""
    tests: tuple[ResidualTest, ...] = field(default=(), repr=False)
    """The tests of the residual."""

    def __str__(self) -> str:
        return self.text

    def to_frame(self, library: str = "pandas") -> Any:
        """The tests, one a row, as a frame of "pandas" or "polars"."""
        names = [field.name for field in fields(ResidualTest)]
        return frame({name: [getattr(test, name) for test in self.tests] for name in names}, library)

    @classmethod
    def of(cls, result: dict[str, Any]) -> Verdict:
        """From the object that ``identify --json`` and ``validate --json`` print."""
        return cls(
            result["holds"],
            result["verdict"],
            result["fit_percent"],
            result["rms"],
            result["r_squared"],
            float("nan") if result["misfit"] is None else result["misfit"],
            tuple(ResidualTest(**test) for test in result["residual_tests"]),
        )
