{% for line in about %}/* {{ line }} */
{% endfor %}
#ifndef {{ name }}_FLEXURE_H
#define {{ name }}_FLEXURE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The state of the model. Its members are private. */
typedef struct {
    int started;
{% for s in steps %}
{% if s.kind == "linear" %}
    double s{{ s.k }}[{{ s.order + 1 }}];
    double level{{ s.k }};
{% elif s.kind == "feedback" %}
    double s{{ s.k }}[{{ s.order }}];
    int away{{ s.k }};
{% elif s.kind == "narx" %}
    double y{{ s.k }}[{{ [2 * s.outputs, 1] | max }}];
    double u{{ s.k }}[{{ [2 * (s.delay + s.inputs), 1] | max }}];
    size_t y_at{{ s.k }};
    size_t u_at{{ s.k }};
{% elif s.kind == "volterra" %}
    double u{{ s.k }}[{{ [2 * (s.delay + s.memory), 1] | max }}];
    size_t u_at{{ s.k }};
{% endif %}
{% endfor %}
} {{ name }}_state;

/* Sets the state at the start. The first step after it starts in the steady state that belongs to its input. */
void {{ name }}_init({{ name }}_state *state);

/* Does the same as {{ name }}_init. */
void {{ name }}_reset({{ name }}_state *state);

/* One sample: {{ "the input" if inputs == 1 else inputs ~ " inputs" }} in, the output out. */
double {{ name }}_step({{ name }}_state *state, {{ "double u" if inputs == 1 else "const double *u" }});

#ifdef __cplusplus
}
#endif

#endif
