{% set kinds = steps | map(attribute="kind") | list %}
{% for line in about %}# {{ line }}
{% endfor %}

import math as _math

{% for s in steps %}
{% for t in s.tables %}
_{{ t.name }}{{ s.k }} = [
{% for line in t.lines %}
    {{ line }}{{ "" if loop.last else "," }}
{% endfor %}
]
{% endfor %}
{% endfor %}

{% if "curve" in kinds or "feedback" in kinds %}

def _curve(x, y, outside, u):
    """A function that is straight between the points of a table; outside: 0 NaN, 1 the nearest end's value, 2 straight on."""
    last = len(x) - 1
    if u != u:
        return _math.nan
    if u < x[0] or u > x[last]:
        end = 0 if u < x[0] else last
        if outside == 0:
            return _math.nan
        if outside == 1 or last == 0:
            return y[end]
        i = 0 if end == 0 else last - 1
    elif last == 0:
        return y[0]
    else:
        i, length = 0, last
        while length > 1:
            half = length // 2
            if x[i + half] <= u:
                i += half
            length -= half
    share = (u - x[i]) / (x[i + 1] - x[i])
    return y[i] + share * (y[i + 1] - y[i])

{% endif %}
{% if "linear" in kinds %}

def _linear(b, a, s, v):
    """A linear system in transposed direct form II; the last state stays zero."""
    y = b[0] * v + s[0]
    for i in range(len(s) - 1):
        s[i] = s[i + 1] + b[i + 1] * v - a[i + 1] * y
    return y

{% endif %}
{% if "surface" in kinds %}

def _splines(low, high, pieces, x):
    """The cubic B-splines that are not zero at x, held within an axis of equal pieces, and the index of the first."""
    place = min(max((x - low) / (high - low) * pieces, 0.0), float(pieces))
    first = min(int(place), pieces - 1)
    t = place - first
    s, t2 = 1.0 - t, t * t
    values = (
        s * s * s / 6.0,
        (3.0 * t2 * t - 6.0 * t2 + 4.0) / 6.0,
        (-3.0 * t2 * t + 3.0 * t2 + 3.0 * t + 1.0) / 6.0,
        t2 * t / 6.0,
    )
    return first, values


def _surface(axes, c, x):
    """A tensor product of cubic B-splines."""
    if any(v != v for v in x):
        return _math.nan
    products = [(0, 1.0)]
    for (low, high, pieces), value in zip(axes, x):
        first, values = _splines(low, high, pieces, value)
        products = [(j * (pieces + 3) + first + k, w * v) for j, w in products for k, v in enumerate(values)]
    return sum(w * c[j] for j, w in products)

{% endif %}
{% if "feedback" in kinds or "volterra" in kinds %}

def _dot(a, b):
    total = 0.0
    for x, y in zip(a, b):
        total += x * y
    return total

{% endif %}

class {{ name }}:
    """The model, one sample a step."""

    sample_time = {{ sample_time or "None" }}
    inputs = {{ inputs }}

    def __init__(self):
        self.init()

    def init(self):
        """Sets the state at the start. The first step after it starts in the steady state that belongs to its input."""
        self._started = False
{% for s in steps %}
{% if s.kind == "linear" %}
        self._s{{ s.k }} = [0.0] * {{ s.order + 1 }}
        self._level{{ s.k }} = 0.0
{% elif s.kind == "feedback" %}
        self._s{{ s.k }} = [0.0] * {{ s.order }}
        self._away{{ s.k }} = False
{% elif s.kind == "narx" %}
        self._y{{ s.k }} = [0.0] * {{ s.outputs }}
        self._u{{ s.k }} = [0.0] * {{ s.delay + s.inputs }}
{% elif s.kind == "volterra" %}
        self._u{{ s.k }} = [0.0] * {{ s.delay + s.memory }}
{% endif %}
{% endfor %}

    def reset(self):
        """Does the same as `init`."""
        self.init()

    def step(self, u):
        """One sample: {{ "the input" if inputs == 1 else "a sequence of " ~ inputs ~ " inputs" }} in, the output out."""
{% if inputs == 1 %}
        r0 = float(u)
{% else %}
        r0{% for i in range(1, inputs) %}, r{{ i }}{% endfor %} = (float(value) for value in u)
{% endif %}
{% for s in steps %}
{% set input = "r" ~ s.from[0] %}
{% if s.kind == "curve" %}
        r{{ s.to }} = _curve(_x{{ s.k }}, _y{{ s.k }}, {{ s.outside }}, {{ input }})
{% elif s.kind == "linear" %}
{% if s.steady %}
        if not self._started:
            self._level{{ s.k }} = {{ input }}
{% endif %}
        r{{ s.to }} = _linear(_b{{ s.k }}, _a{{ s.k }}, self._s{{ s.k }}, {{ input }} - self._level{{ s.k }}) + {{ s.gain }} * self._level{{ s.k }}
{% elif s.kind == "surface" %}
        axes = ({% for a in s.axes %}({{ a.low }}, {{ a.high }}, {{ a.pieces }}), {% endfor %})
        r{{ s.to }} = _surface(axes, _c{{ s.k }}, ({% for r in s.from %}r{{ r }}, {% endfor %}))
{% elif s.kind == "sum" %}
        r{{ s.to }} = {% for r in s.from %}r{{ r }}{{ "" if loop.last else " + " }}{% endfor %}

{% elif s.kind == "offset" %}
        r{{ s.to }} = {{ input }} + {{ s.offset }}
{% elif s.kind == "feedback" %}
        r{{ s.to }} = self._loop{{ s.k }}({{ input }})
{% elif s.kind == "narx" %}
        r{{ s.to }} = self._narx{{ s.k }}({{ input }})
{% else %}
        r{{ s.to }} = self._volterra{{ s.k }}({{ input }})
{% endif %}
{% endfor %}
        self._started = True
        return r{{ output }}

    def simulate(self, u):
        """The outputs of a sequence of samples, from the start on: a list."""
        self.init()
        return [self.step(sample) for sample in u]
{% for s in steps %}
{% if s.kind == "feedback" %}

    def _loop{{ s.k }}(self, u):
        if not self._started:
            self._rest{{ s.k }}(u)
        if self._away{{ s.k }}:
            return _math.nan
        y, z = self._loop_step{{ s.k }}(u)
        self._away{{ s.k }} = not (abs(y) <= {{ s.limit }} and abs(z) <= {{ s.limit }})
        return _math.nan if self._away{{ s.k }} else y

    def _loop_step{{ s.k }}(self, u):
        x, u = self._s{{ s.k }}, u - {{ s.input }}
        z = {{ s.entering }} + _dot(_Cz{{ s.k }}, x) + {{ s.input_to_nonlinearity }} * u
        w = _curve(_x{{ s.k }}, _y{{ s.k }}, {{ s.outside }}, z) - {{ s.nonlinearity }}
        y = {{ s.output }} + _dot(_Cy{{ s.k }}, x) + {{ s.input_to_output }} * u + {{ s.nonlinearity_to_output }} * w
        n = {{ s.order }}
        self._s{{ s.k }} = [_dot(_A{{ s.k }}[n * i : n * i + n], x) + _Bu{{ s.k }}[i] * u + _Bw{{ s.k }}[i] * w for i in range(n)]
        return y, z

    def _rest{{ s.k }}(self, u):
        """The state in which the loop rests under a constant input; zero if it does not come to rest."""
        self._s{{ s.k }} = [0.0] * {{ s.order }}
        for _ in range({{ s.longest_rest }}):
            before = self._s{{ s.k }}
            y, _z = self._loop_step{{ s.k }}(u)
            if not abs(y) <= {{ s.limit }}:
                break
            size = 0.0
            for v in self._s{{ s.k }}:
                size = max(size, abs(v))
            if all(abs(v - b) <= {{ s.at_rest }} * size for v, b in zip(self._s{{ s.k }}, before)):
                return
        self._s{{ s.k }} = [0.0] * {{ s.order }}
{% elif s.kind == "narx" %}

    def _narx{{ s.k }}(self, u):
        self._u{{ s.k }} = [(u - {{ s.u_mean }}) / {{ s.u_spread }}, *self._u{{ s.k }}][: {{ s.delay + s.inputs }}]
        lagged = self._y{{ s.k }} + self._u{{ s.k }}[{{ s.delay }} :]
        terms, at = 0.0, 0
        for coefficient, length in zip(_c{{ s.k }}, _lengths{{ s.k }}):
            product = 1.0
            for factor in _factors{{ s.k }}[at : at + length]:
                product *= lagged[factor]
            at += length
            terms += coefficient * product
        value = {{ s.constant }} + terms
        # Held within bounds; what is no number counts as the mean.
        value = {{ s.held_mean }} if value != value else min(max(value, {{ s.low }}), {{ s.high }})
        self._y{{ s.k }} = [value, *self._y{{ s.k }}][: {{ s.outputs }}]
        return {{ s.y_mean }} + {{ s.y_spread }} * value
{% elif s.kind == "volterra" %}

    def _volterra{{ s.k }}(self, u):
        self._u{{ s.k }} = [u - {{ s.level }}, *self._u{{ s.k }}][: {{ s.delay + s.memory }}]
        recent, m = self._u{{ s.k }}[{{ s.delay }} :], {{ s.second }}
        second = 0.0
        for i in range(m):
            second += recent[i] * _dot(_h2{{ s.k }}[m * i : m * i + m], recent)
        return {{ s.constant }} + _dot(_h1{{ s.k }}, recent) + second
{% endif %}
{% endfor %}
