{% for line in about %}/* {{ line }} */
{% endfor %}
#ifndef {{ name }}_FLEXURE_H
#define {{ name }}_FLEXURE_H

#ifdef __cplusplus
extern "C" {
#endif

/* The state of the arm: q1, q2, qm1, qm2 in rad, then their velocities in rad/s. */
typedef struct {
    double x[8];
} {{ name }}_state;

/* Sets the state at the start. */
void {{ name }}_init({{ name }}_state *state);

/* Does the same as {{ name }}_init. */
void {{ name }}_reset({{ name }}_state *state);

/* One sample: writes the state at its instant to y, eight numbers, and holds the two motor torques tau, N m, until the next. */
void {{ name }}_step({{ name }}_state *state, const double *tau, double *y);

#ifdef __cplusplus
}
#endif

#endif
