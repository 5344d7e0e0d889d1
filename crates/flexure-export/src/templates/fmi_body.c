/* What FMI 2.0 and 3.0 have in common: an instance, its variables and its step. */

#include "{{ name }}.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define INPUTS {{ inputs }}
#define OUTPUTS {{ results | length }}
#define TIME (INPUTS + OUTPUTS + 1)
#define PARAMETERS {{ parameters | length }}
{% if not is_static %}
#define SAMPLE_TIME {{ sample_time or "1.0" }}
{% endif %}

{% if parameters %}
static const double parameters[PARAMETERS] = {
{% for p in parameters %}
    {{ p.value }}, /* {{ p.name }} */
{% endfor %}
};

{% endif %}
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status;

typedef struct {
    {{ name }}_state state;
{% if not is_arm and not is_static %}
    {{ name }}_state ahead; /* for the output before the first step */
{% endif %}
    double time;
    double u[INPUTS];
{% if not is_static %}
    double y[OUTPUTS];
    int stepped;
{% endif %}
} Instance;

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif
/* For static linking, define FMI{{ version }}_FUNCTION_PREFIX. */
#define PASTE2(a, b) a##b
#define PASTE(a, b) PASTE2(a, b)
#ifdef FMI{{ version }}_FUNCTION_PREFIX
#define FMI(name) PASTE(FMI{{ version }}_FUNCTION_PREFIX, name)
#else
#define FMI(name) name
#endif

static void restart(Instance *instance)
{
    memset(instance, 0, sizeof *instance);
    {{ name }}_init(&instance->state);
}

static Instance *created(void)
{
    Instance *instance = malloc(sizeof *instance);
    if (instance != NULL) {
        restart(instance);
    }
    return instance;
}

/* The state after this one, and the outputs, for the present inputs. */
static void stepped({{ name }}_state *state, const double *u, double *y)
{
{% if is_arm %}
    {{ name }}_step(state, u, y);
{% else %}
    y[0] = {{ name }}_step(state, {{ "u[0]" if inputs == 1 else "u" }});
{% endif %}
}

static Status get(Instance *instance, const unsigned int *references, size_t n, double *values)
{
    size_t i;
    for (i = 0U; i < n; i++) {
        const unsigned int reference = references[i];
        if (reference < INPUTS) {
            values[i] = instance->u[reference];
        } else if (reference < INPUTS + OUTPUTS) {
{% if is_arm %}
            values[i] = instance->state.x[reference - INPUTS];
{% elif is_static %}
            stepped(&instance->state, instance->u, &values[i]);
{% else %}
            if (instance->stepped == 0) {
                instance->ahead = instance->state;
                stepped(&instance->ahead, instance->u, instance->y);
            }
            values[i] = instance->y[reference - INPUTS];
{% endif %}
{% if not is_static %}
        } else if (reference == INPUTS + OUTPUTS) {
            values[i] = SAMPLE_TIME;
{% endif %}
        } else if (reference == TIME) {
            values[i] = instance->time;
{% if parameters %}
        } else if ((reference > TIME) && (reference - TIME <= PARAMETERS)) {
            values[i] = parameters[reference - TIME - 1];
{% endif %}
        } else {
            return ERROR;
        }
    }
    return OK;
}

static Status set(Instance *instance, const unsigned int *references, size_t n, const double *values)
{
    size_t i;
    for (i = 0U; i < n; i++) {
        if (references[i] >= INPUTS) {
            return ERROR;
        }
        instance->u[references[i]] = values[i];
    }
    return OK;
}

{% if is_static %}
/* Nothing changes with time but the inputs: every step is taken. */
static Status advance(Instance *instance, double duration)
{
    (void)instance;
    return (duration >= 0.0) ? OK : ERROR;
}
{% else %}
/* Steps over a whole number of samples; the inputs are held. */
static Status advance(Instance *instance, double duration)
{
    const double samples = floor((duration / SAMPLE_TIME) + 0.5);
    double k;
    if (!((samples >= 1.0) && (fabs((samples * SAMPLE_TIME) - duration) <= (1e-6 * SAMPLE_TIME)))) {
        return ERROR;
    }
    for (k = 0.0; k < samples; k += 1.0) {
        stepped(&instance->state, instance->u, instance->y);
    }
    instance->stepped = 1;
    return OK;
}
{% endif %}

static Status save(const Instance *instance, void **kept)
{
    if (*kept == NULL) {
        *kept = malloc(sizeof *instance);
    }
    if (*kept == NULL) {
        return ERROR;
    }
    memcpy(*kept, instance, sizeof *instance);
    return OK;
}
