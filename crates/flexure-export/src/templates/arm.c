{% for line in about %}/* {{ line }} */
{% endfor %}
#include "{{ header }}"

#include <math.h>

/* The links: shoulder, elbow and coupling of the inertia matrix (5), kg m^2. */
static const double links[3] = { {{ links | join(", ") }} };
{% if not rigid %}
/* The stiffness (10), (11) of each joint: cubic, linear, wind-up and its sharpness; and the damping. */
static const double stiffness[2][5] = {
    { {{ stiffness[0] | join(", ") }} },
    { {{ stiffness[1] | join(", ") }} }
};
{% endif %}
/* The friction (12) of each joint, and of each motor. */
static const double friction[4][6] = {
{% for g in friction %}
    { {{ g | join(", ") }} }{{ "," if not loop.last }}
{% endfor %}
};
static const double start[8] = { {{ start | join(", ") }} };
/* The integrator's step, s, and its steps a sample. */
static const double h = {{ h }};
static const int steps = {{ steps }};
/* The integrator's weights: of each stage, and of the step. */
static const double stages[12][11] = {
{% for row in stages %}
    { {{ row | join(", ") }} }{{ "," if not loop.last }}
{% endfor %}
};
static const double solution[12] = { {{ solution | join(", ") }} };

static double friction_torque(const double *g, double v)
{
    return (g[0] * (tanh(g[1] * v) - tanh(g[2] * v))) + (g[3] * tanh(g[4] * v)) + (g[5] * v);
}

/* The derivative of the state: equations (4), or (7) and (8). */
static void derivative(const double *x, const double *tau, double *dx)
{
    const double s = links[2] * sin(x[1]);
    const double c = links[2] * cos(x[1]);
    const double m12 = links[1] + c{{ " + " ~ coupling if geared }};
    const double m11 = links[0] + (2.0 * c){{ diagonal[0] }};
    const double m22 = links[1]{{ diagonal[1] }};
    double r[2];
    double a[2];
    double am[2];
    int i;
{% if not rigid %}
    double drive[2];
{% endif %}
    r[0] = (s * ((2.0 * x[4]) + x[5]) * x[5]) - friction_torque(friction[0], x[4]);
    r[1] = (-s * x[4] * x[4]) - friction_torque(friction[1], x[5]);
{% if rigid %}
    for (i = 0; i < 2; i++) {
        r[i] += tau[i] - friction_torque(friction[2 + i], x[4 + i]);
    }
{% else %}
    for (i = 0; i < 2; i++) {
        const double *k = stiffness[i];
        const double d = x[2 + i] - x[i];
        const double elastic =
            (((k[0] * d * d) + k[1]) - (k[2] * exp(-k[3] * d * d))) * d + (k[4] * (x[6 + i] - x[4 + i]));
        r[i] += elastic;
        drive[i] = tau[i] - elastic - friction_torque(friction[2 + i], x[6 + i]);
    }
{% if coupled %}
    r[0] -= drive[1];
{% endif %}
{% endif %}
{% if free[0] and free[1] %}
    a[0] = (r[0] - ((m12 / m22) * r[1])) / (m11 - ((m12 / m22) * m12));
    a[1] = (r[1] - (m12 * a[0])) / m22;
{% elif free[0] %}
    (void)m12;
    (void)m22;
    a[0] = r[0] / m11;
    a[1] = 0.0;
{% elif free[1] %}
    (void)m11;
    (void)m12;
    a[0] = 0.0;
    a[1] = r[1] / m22;
{% else %}
    (void)m11;
    (void)m12;
    (void)m22;
    (void)r;
    a[0] = 0.0;
    a[1] = 0.0;
{% endif %}
{% if rigid %}
    am[0] = a[0];
    am[1] = a[1];
{% else %}
{% if not (free[0] or free[1]) %}
    (void)drive;
{% endif %}
    am[0] = {{ "drive[0] / " ~ motor[0] if free[0] else "0.0" }};
    am[1] = {{ "(drive[1] - (" ~ coupling ~ " * a[0])) / " ~ motor[1] if free[1] else "0.0" }};
{% endif %}
    for (i = 0; i < 4; i++) {
        dx[i] = x[4 + i];
    }
    for (i = 0; i < 2; i++) {
        dx[4 + i] = a[i];
        dx[6 + i] = am[i];
    }
}

void {{ name }}_init({{ name }}_state *state)
{
    int i;
    for (i = 0; i < 8; i++) {
        state->x[i] = start[i];
    }
}

void {{ name }}_reset({{ name }}_state *state)
{
    {{ name }}_init(state);
}

/* The method of Dormand and Prince of order 8. */
void {{ name }}_step({{ name }}_state *state, const double *tau, double *y)
{
    double slopes[12][8];
    double at[8];
    double sum;
    int i;
    int k;
    int n;
    int stage;
    for (i = 0; i < 8; i++) {
        y[i] = state->x[i];
    }
    for (n = 0; n < steps; n++) {
        for (stage = 0; stage < 12; stage++) {
            for (i = 0; i < 8; i++) {
                sum = 0.0;
                for (k = 0; k < stage; k++) {
                    sum += stages[stage][k] * slopes[k][i];
                }
                at[i] = state->x[i] + (h * sum);
            }
            derivative(at, tau, slopes[stage]);
        }
        for (i = 0; i < 8; i++) {
            sum = 0.0;
            for (k = 0; k < 12; k++) {
                sum += solution[k] * slopes[k][i];
            }
            state->x[i] += h * sum;
        }
    }
}
