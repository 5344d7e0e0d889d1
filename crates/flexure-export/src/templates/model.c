{% set kinds = steps | map(attribute="kind") | list %}
{% for line in about %}/* {{ line }} */
{% endfor %}
#include "{{ header }}"

{% if "curve" in kinds or "feedback" in kinds or "surface" in kinds %}
#include <math.h>
{% endif %}
#include <stddef.h>

{% for s in steps %}
{% for t in s.tables %}
static const {{ "size_t" if t.whole else "double" }} {{ name }}_{{ t.name }}{{ s.k }}[{{ [t.length, 1] | max }}] = {
{% for line in t.lines %}
    {{ line }}{{ "" if loop.last else "," }}
{% else %}
    0
{% endfor %}
};
{% endfor %}
{% endfor %}

{% if "curve" in kinds or "feedback" in kinds %}
/* A function that is straight between the points of a table. */
typedef struct {
    size_t points;
    const double *x;
    const double *y;
    int outside; /* 0: NaN, 1: the nearest end's value, 2: straight on */
} {{ name }}_curve_data;

static double {{ name }}_curve(const {{ name }}_curve_data *c, double u)
{
    const size_t last = c->points - 1U;
    size_t i = 0U; /* the point to the left */
    double share;

    if (isnan(u)) {
        return NAN;
    }
    if ((u < c->x[0]) || (u > c->x[last])) {
        const size_t end = (u < c->x[0]) ? 0U : last;
        if (c->outside == 0) {
            return NAN;
        }
        if ((c->outside == 1) || (last == 0U)) {
            return c->y[end];
        }
        i = (end == 0U) ? 0U : (last - 1U);
    } else if (last == 0U) {
        return c->y[0];
    } else {
        size_t length = last;
        while (length > 1U) {
            const size_t half = length / 2U;
            i = (c->x[i + half] <= u) ? (i + half) : i;
            length -= half;
        }
    }
    share = (u - c->x[i]) / (c->x[i + 1U] - c->x[i]);
    return c->y[i] + (share * (c->y[i + 1U] - c->y[i]));
}

{% endif %}
{% if "linear" in kinds %}
/* A linear system in transposed direct form II, around the level of its first input. */
typedef struct {
    size_t order;
    const double *b;
    const double *a;
    double gain; /* static gain */
    int steady;  /* whether it has a steady state */
} {{ name }}_linear_data;

static double {{ name }}_linear(const {{ name }}_linear_data *g, double *s, double *level, int first, double u)
{
    double v;
    double y;
    size_t i;

    if (first != 0) {
        *level = (g->steady != 0) ? u : 0.0;
    }
    v = u - *level;
    y = (g->b[0] * v) + s[0];
    for (i = 0U; i < g->order; i++) {
        s[i] = (s[i + 1U] + (g->b[i + 1U] * v)) - (g->a[i + 1U] * y);
    }
    return y + (g->gain * *level);
}

{% endif %}
{% if "surface" in kinds %}
/* The cubic B-splines that are not zero at x, held within an axis of equal pieces; returns the index of the first. */
static size_t {{ name }}_splines(double low, double high, size_t pieces, double x, double v[4])
{
    double place = ((x - low) / (high - low)) * (double)pieces;
    size_t first;
    double t;
    double s;
    double t2;

    place = (place < 0.0) ? 0.0 : place;
    place = (place > (double)pieces) ? (double)pieces : place;
    first = (size_t)place;
    first = (first > (pieces - 1U)) ? (pieces - 1U) : first;
    t = place - (double)first;
    s = 1.0 - t;
    t2 = t * t;
    v[0] = ((s * s) * s) / 6.0;
    v[1] = (((3.0 * t2 * t) - (6.0 * t2)) + 4.0) / 6.0;
    v[2] = ((((-3.0 * t2) * t) + (3.0 * t2)) + (3.0 * t) + 1.0) / 6.0;
    v[3] = (t2 * t) / 6.0;
    return first;
}

{% for s in steps if s.kind == "surface" %}
static double {{ name }}_surface{{ s.k }}(const double *x)
{
    double v[{{ s.axes | length }}][4];
    size_t first[{{ s.axes | length }}];
    double sum = 0.0;
{% for a in s.axes %}
    size_t k{{ loop.index0 }};
{% endfor %}

    if ({% for a in s.axes %}isnan(x[{{ loop.index0 }}]){{ "" if loop.last else " || " }}{% endfor %}) {
        return NAN;
    }
{% for a in s.axes %}
    first[{{ loop.index0 }}] = {{ name }}_splines({{ a.low }}, {{ a.high }}, {{ a.pieces }}U, x[{{ loop.index0 }}], v[{{ loop.index0 }}]);
{% endfor %}
{% for a in s.axes %}
{% set i = loop.index0 %}
    for (k{{ i }} = 0U; k{{ i }} < 4U; k{{ i }}++) {
        const double w{{ i }} = {% if i > 0 %}w{{ i - 1 }} * {% endif %}v[{{ i }}][k{{ i }}];
        const size_t j{{ i }} = {% if i > 0 %}(j{{ i - 1 }} * {{ a.splines }}U) + {% endif %}first[{{ i }}] + k{{ i }};
{% endfor %}
        sum += w{{ (s.axes | length) - 1 }} * {{ name }}_c{{ s.k }}[j{{ (s.axes | length) - 1 }}];
{% for a in s.axes %}
    }
{% endfor %}
    return sum;
}

{% endfor %}
{% endif %}
{% if "feedback" in kinds %}
/* Linear dynamics around a static nonlinearity. */
typedef struct {
    size_t order;
    const double *A;
    const double *Bu;
    const double *Bw;
    const double *Cy;
    const double *Cz;
    double input; /* levels */
    double nonlinearity;
    double output;
    double entering;
    double input_to_output;
    double nonlinearity_to_output;
    double input_to_nonlinearity;
    double limit; /* beyond it a signal has run away */
    {{ name }}_curve_data curve;
} {{ name }}_loop_data;

static double {{ name }}_dot(size_t n, const double *a, const double *b)
{
    double sum = 0.0;
    size_t i;

    for (i = 0U; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* One sample of the loop; returns what enters the nonlinearity, and gives the output. */
static double {{ name }}_loop_step(const {{ name }}_loop_data *g, double *x, double *next, double input, double *y)
{
    const double u = input - g->input;
    const double z = (g->entering + {{ name }}_dot(g->order, g->Cz, x)) + (g->input_to_nonlinearity * u);
    const double w = {{ name }}_curve(&g->curve, z) - g->nonlinearity;
    size_t i;

    *y = ((g->output + {{ name }}_dot(g->order, g->Cy, x)) + (g->input_to_output * u)) + (g->nonlinearity_to_output * w);
    for (i = 0U; i < g->order; i++) {
        next[i] = ({{ name }}_dot(g->order, &g->A[i * g->order], x) + (g->Bu[i] * u)) + (g->Bw[i] * w);
    }
    for (i = 0U; i < g->order; i++) {
        x[i] = next[i];
    }
    return z;
}

/* The state in which the loop rests under a constant input; zero if it does not come to rest. */
static void {{ name }}_loop_rest(const {{ name }}_loop_data *g, double *x, double *next, double *before, double u)
{
    long n;
    size_t i;

    for (i = 0U; i < g->order; i++) {
        x[i] = 0.0;
    }
    for (n = 0; n < {{ (steps | selectattr("kind", "equalto", "feedback") | first).longest_rest }}L; n++) {
        double y = 0.0;
        double size = 0.0;
        int settled = 1;

        for (i = 0U; i < g->order; i++) {
            before[i] = x[i];
        }
        (void){{ name }}_loop_step(g, x, next, u, &y);
        if (!(fabs(y) <= g->limit)) {
            break;
        }
        for (i = 0U; i < g->order; i++) {
            size = (fabs(x[i]) > size) ? fabs(x[i]) : size;
        }
        for (i = 0U; i < g->order; i++) {
            if (!(fabs(x[i] - before[i]) <= ({{ (steps | selectattr("kind", "equalto", "feedback") | first).at_rest }} * size))) {
                settled = 0;
            }
        }
        if (settled != 0) {
            return;
        }
    }
    for (i = 0U; i < g->order; i++) {
        x[i] = 0.0;
    }
}

static double {{ name }}_loop(const {{ name }}_loop_data *g, double *x, double *next, double *before, int *away, int first, double u)
{
    double y = NAN;

    if (first != 0) {
        {{ name }}_loop_rest(g, x, next, before, u);
    }
    if (*away == 0) {
        const double z = {{ name }}_loop_step(g, x, next, u, &y);
        if (!((fabs(y) <= g->limit) && (fabs(z) <= g->limit))) {
            *away = 1;
        }
    }
    return (*away == 0) ? y : NAN;
}

{% endif %}
{% if "narx" in kinds or "volterra" in kinds %}
/* Puts the newest value in front of the others, and returns where it stands. Every value is kept twice, so that those of any time stand in a row. */
static const double *{{ name }}_push(double *values, size_t *at, size_t length, double newest)
{
    if (length == 0U) {
        return values;
    }
    *at = (*at == 0U) ? (length - 1U) : (*at - 1U);
    values[*at] = newest;
    values[*at + length] = newest;
    return &values[*at];
}

{% endif %}
{% if "volterra" in kinds %}
static double {{ name }}_kernel(const double *h, const double *u, size_t length)
{
    double sum = 0.0;
    size_t i;

    for (i = 0U; i < length; i++) {
        sum += h[i] * u[i];
    }
    return sum;
}

{% endif %}
{% for s in steps %}
{% if s.kind == "curve" %}
static const {{ name }}_curve_data {{ name }}_step{{ s.k }} = { {{ s.points }}U, {{ name }}_x{{ s.k }}, {{ name }}_y{{ s.k }}, {{ s.outside }} };

{% elif s.kind == "linear" %}
static const {{ name }}_linear_data {{ name }}_step{{ s.k }} = { {{ s.order }}U, {{ name }}_b{{ s.k }}, {{ name }}_a{{ s.k }}, {{ s.gain }}, {{ 1 if s.steady else 0 }} };

{% elif s.kind == "feedback" %}
static const {{ name }}_loop_data {{ name }}_step{{ s.k }} = {
    {{ s.order }}U, {{ name }}_A{{ s.k }}, {{ name }}_Bu{{ s.k }}, {{ name }}_Bw{{ s.k }}, {{ name }}_Cy{{ s.k }}, {{ name }}_Cz{{ s.k }},
    {{ s.input }}, {{ s.nonlinearity }}, {{ s.output }}, {{ s.entering }},
    {{ s.input_to_output }}, {{ s.nonlinearity_to_output }}, {{ s.input_to_nonlinearity }}, {{ s.limit }},
    { {{ s.points }}U, {{ name }}_x{{ s.k }}, {{ name }}_y{{ s.k }}, {{ s.outside }} }
};

{% elif s.kind == "narx" %}
static double {{ name }}_narx{{ s.k }}(double *y, size_t *y_at, double *u, size_t *u_at, double input)
{
    const size_t count = {{ s.terms }}U;
    const size_t outputs = {{ s.outputs }}U;
    const double *past = &y[*y_at];
    const double *recent = {{ name }}_push(u, u_at, {{ s.delay + s.inputs }}U, (input - {{ s.u_mean }}) / {{ s.u_spread }});
    double value = {{ s.constant }};
    double terms = 0.0;
    size_t factor = 0U;
    size_t i;
    size_t k;

    for (i = 0U; i < count; i++) {
        double product = 1.0;
        for (k = 0U; k < {{ name }}_lengths{{ s.k }}[i]; k++) {
            const size_t at = {{ name }}_factors{{ s.k }}[factor];
            product *= (at < outputs) ? past[at] : recent[{{ s.delay }}U + (at - outputs)];
            factor++;
        }
        terms += {{ name }}_c{{ s.k }}[i] * product;
    }
    value += terms;
    /* Held within bounds; what is no number counts as the mean. */
    value = (value >= {{ s.low }}) ? value : ((value < {{ s.low }}) ? {{ s.low }} : {{ s.held_mean }});
    value = (value > {{ s.high }}) ? {{ s.high }} : value;
    (void){{ name }}_push(y, y_at, outputs, value);
    return {{ s.y_mean }} + ({{ s.y_spread }} * value);
}

{% elif s.kind == "volterra" %}
static double {{ name }}_volterra{{ s.k }}(double *u, size_t *u_at, double input)
{
    const size_t memory = {{ s.second }}U;
    const double *recent = &{{ name }}_push(u, u_at, {{ s.delay + s.memory }}U, input - {{ s.level }})[{{ s.delay }}];
    double second = 0.0;
    size_t i;

    for (i = 0U; i < memory; i++) {
        second += recent[i] * {{ name }}_kernel(&{{ name }}_h2{{ s.k }}[i * memory], recent, memory);
    }
    return ({{ s.constant }} + {{ name }}_kernel({{ name }}_h1{{ s.k }}, recent, {{ s.first }}U)) + second;
}

{% endif %}
{% endfor %}
void {{ name }}_init({{ name }}_state *state)
{
    static const {{ name }}_state zero = { 0 };

    *state = zero;
}

void {{ name }}_reset({{ name }}_state *state)
{
    {{ name }}_init(state);
}

double {{ name }}_step({{ name }}_state *state, {{ "double u" if inputs == 1 else "const double *u" }})
{
{% if "linear" in kinds or "feedback" in kinds %}
    const int first = (state->started == 0) ? 1 : 0;
{% endif %}
{% if "feedback" in kinds %}
    double next[{{ steps | selectattr("kind", "equalto", "feedback") | map(attribute="order") | max }}];
    double before[{{ steps | selectattr("kind", "equalto", "feedback") | map(attribute="order") | max }}];
{% endif %}
{% for i in range(inputs) %}
    const double r{{ i }} = {{ "u" if inputs == 1 else "u[" ~ i ~ "]" }};
{% endfor %}
{% for s in steps %}
{% set input = "r" ~ s.from[0] %}
{% if s.kind == "surface" %}
    const double at{{ s.k }}[{{ s.from | length }}] = { {% for r in s.from %}r{{ r }}{{ "" if loop.last else ", " }}{% endfor %} };
{% endif %}
    const double r{{ s.to }} = {% if s.kind == "curve" -%}
        {{ name }}_curve(&{{ name }}_step{{ s.k }}, {{ input }})
    {%- elif s.kind == "linear" -%}
        {{ name }}_linear(&{{ name }}_step{{ s.k }}, state->s{{ s.k }}, &state->level{{ s.k }}, first, {{ input }})
    {%- elif s.kind == "surface" -%}
        {{ name }}_surface{{ s.k }}(at{{ s.k }})
    {%- elif s.kind == "sum" -%}
        {% for r in s.from %}r{{ r }}{{ "" if loop.last else " + " }}{% endfor %}
    {%- elif s.kind == "offset" -%}
        {{ input }} + {{ s.offset }}
    {%- elif s.kind == "feedback" -%}
        {{ name }}_loop(&{{ name }}_step{{ s.k }}, state->s{{ s.k }}, next, before, &state->away{{ s.k }}, first, {{ input }})
    {%- elif s.kind == "narx" -%}
        {{ name }}_narx{{ s.k }}(state->y{{ s.k }}, &state->y_at{{ s.k }}, state->u{{ s.k }}, &state->u_at{{ s.k }}, {{ input }})
    {%- else -%}
        {{ name }}_volterra{{ s.k }}(state->u{{ s.k }}, &state->u_at{{ s.k }}, {{ input }})
    {%- endif %};
{% endfor %}

    state->started = 1;
    return r{{ output }};
}
