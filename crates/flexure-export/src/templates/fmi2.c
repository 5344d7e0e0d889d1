{% for line in about %}/* {{ line }} */
{% endfor %}
{% set version = 2 %}
{% include "fmi_body.c" %}

EXPORT const char *FMI(fmi2GetTypesPlatform)(void) { return "default"; }
EXPORT const char *FMI(fmi2GetVersion)(void) { return "2.0"; }

EXPORT void *FMI(fmi2Instantiate)(const char *name, int type, const char *guid, const char *resources, const void *callbacks, int visible, int logging)
{
    (void)name;
    (void)resources;
    (void)callbacks;
    (void)visible;
    (void)logging;
    /* 1 is co-simulation. */
    return ((type == 1) && (guid != NULL) && (strcmp(guid, "{{ token }}") == 0)) ? created() : NULL;
}
EXPORT void FMI(fmi2FreeInstance)(void *c) { free(c); }
EXPORT Status FMI(fmi2SetDebugLogging)(void *c, int on, size_t n, const char *const categories[])
{
    (void)c;
    (void)on;
    (void)n;
    (void)categories;
    return OK;
}
EXPORT Status FMI(fmi2SetupExperiment)(void *c, int tolerance_defined, double tolerance, double start, int stop_defined, double stop)
{
    (void)c;
    (void)tolerance_defined;
    (void)tolerance;
    (void)start;
    (void)stop_defined;
    (void)stop;
    return OK;
}
{% for f in ["EnterInitializationMode", "ExitInitializationMode", "Terminate"] %}
EXPORT Status FMI(fmi2{{ f }})(void *c) { (void)c; return OK; }
{% endfor %}
EXPORT Status FMI(fmi2Reset)(void *c) { restart(c); return OK; }
EXPORT Status FMI(fmi2GetReal)(void *c, const unsigned int r[], size_t n, double v[]) { return get(c, r, n, v); }
EXPORT Status FMI(fmi2SetReal)(void *c, const unsigned int r[], size_t n, const double v[]) { return set(c, r, n, v); }
{% for t, type in [("Integer", "int"), ("Boolean", "int"), ("String", "const char *")] %}
EXPORT Status FMI(fmi2Get{{ t }})(void *c, const unsigned int r[], size_t n, {{ type }} v[]) { (void)c; (void)r; (void)v; return (n == 0U) ? OK : ERROR; }
EXPORT Status FMI(fmi2Set{{ t }})(void *c, const unsigned int r[], size_t n, {{ type }} const v[]) { (void)c; (void)r; (void)v; return (n == 0U) ? OK : ERROR; }
{% endfor %}
EXPORT Status FMI(fmi2DoStep)(void *c, double time, double step, int forget)
{
    (void)time;
    (void)forget;
    return advance(c, step);
}
EXPORT Status FMI(fmi2GetFMUstate)(void *c, void **kept) { return save(c, kept); }
EXPORT Status FMI(fmi2SetFMUstate)(void *c, void *kept) { memcpy(c, kept, sizeof(Instance)); return OK; }
EXPORT Status FMI(fmi2FreeFMUstate)(void *c, void **kept) { (void)c; free(*kept); *kept = NULL; return OK; }

/* What this FMU does not offer, as its description says. */
{% for f, types in [
    ("SerializedFMUstateSize", ["void *", "size_t *"]),
    ("SerializeFMUstate", ["void *", "char *", "size_t"]),
    ("DeSerializeFMUstate", ["const char *", "size_t", "void **"]),
    ("GetDirectionalDerivative", ["const unsigned int *", "size_t", "const unsigned int *", "size_t", "const double *", "double *"]),
    ("SetRealInputDerivatives", ["const unsigned int *", "size_t", "const int *", "const double *"]),
    ("GetRealOutputDerivatives", ["const unsigned int *", "size_t", "const int *", "double *"]),
    ("CancelStep", []),
    ("GetStatus", ["int", "int *"]),
    ("GetRealStatus", ["int", "double *"]),
    ("GetIntegerStatus", ["int", "int *"]),
    ("GetBooleanStatus", ["int", "int *"]),
    ("GetStringStatus", ["int", "const char **"]),
] %}
EXPORT Status FMI(fmi2{{ f }})(void *c{% for t in types %}, {{ t }} a{{ loop.index }}{% endfor %}) { (void)c;{% for t in types %} (void)a{{ loop.index }};{% endfor %} return ERROR; }
{% endfor %}
