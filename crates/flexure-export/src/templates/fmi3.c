{% for line in about %}/* {{ line }} */
{% endfor %}
{% set version = 3 %}
{% include "fmi_body.c" %}

EXPORT const char *FMI(fmi3GetVersion)(void) { return "3.0"; }

EXPORT void *FMI(fmi3InstantiateCoSimulation)(const char *name, const char *token, const char *resources, bool visible, bool logging,
    bool events, bool early, const unsigned int *intermediate, size_t n, void *environment, const void *log, const void *update)
{
    (void)name;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)events;
    (void)early;
    (void)intermediate;
    (void)n;
    (void)environment;
    (void)log;
    (void)update;
    return ((token != NULL) && (strcmp(token, "{{ token }}") == 0)) ? created() : NULL;
}
EXPORT void *FMI(fmi3InstantiateModelExchange)(const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, const void *log)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)log;
    return NULL;
}
EXPORT void *FMI(fmi3InstantiateScheduledExecution)(const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, const void *log, const void *update, const void *lock, const void *unlock)
{
    (void)lock;
    (void)unlock;
    (void)update;
    return FMI(fmi3InstantiateModelExchange)(name, token, resources, visible, logging, environment, log);
}
EXPORT void FMI(fmi3FreeInstance)(void *c) { free(c); }
EXPORT Status FMI(fmi3SetDebugLogging)(void *c, bool on, size_t n, const char *const categories[])
{
    (void)c;
    (void)on;
    (void)n;
    (void)categories;
    return OK;
}
EXPORT Status FMI(fmi3EnterInitializationMode)(void *c, bool tolerance_defined, double tolerance, double start, bool stop_defined, double stop)
{
    (void)tolerance_defined;
    (void)tolerance;
    (void)stop_defined;
    (void)stop;
    ((Instance *)c)->time = start;
    return OK;
}
{% for f in ["ExitInitializationMode", "Terminate"] %}
EXPORT Status FMI(fmi3{{ f }})(void *c) { (void)c; return OK; }
{% endfor %}
EXPORT Status FMI(fmi3Reset)(void *c) { restart(c); return OK; }
EXPORT Status FMI(fmi3GetFloat64)(void *c, const unsigned int r[], size_t n, double v[], size_t m)
{
    return (n == m) ? get(c, r, n, v) : ERROR;
}
EXPORT Status FMI(fmi3SetFloat64)(void *c, const unsigned int r[], size_t n, const double v[], size_t m)
{
    return (n == m) ? set(c, r, n, v) : ERROR;
}
EXPORT Status FMI(fmi3DoStep)(void *c, double time, double step, bool forget, bool *event, bool *terminate, bool *early, double *last)
{
    const Status status = advance(c, step);
    (void)forget;
    *event = false;
    *terminate = false;
    *early = false;
    *last = (status == OK) ? (time + step) : time;
    ((Instance *)c)->time = *last;
    return status;
}
EXPORT Status FMI(fmi3GetFMUState)(void *c, void **kept) { return save(c, kept); }
EXPORT Status FMI(fmi3SetFMUState)(void *c, void *kept) { memcpy(c, kept, sizeof(Instance)); return OK; }
EXPORT Status FMI(fmi3FreeFMUState)(void *c, void **kept) { (void)c; free(*kept); *kept = NULL; return OK; }

/* What this FMU does not offer, as its description says. */
{% set refs = ["const unsigned int *", "size_t"] %}
{% for t, type in [("Float32", "float"), ("Int8", "int8_t"), ("UInt8", "uint8_t"), ("Int16", "int16_t"), ("UInt16", "uint16_t"),
    ("Int32", "int32_t"), ("UInt32", "uint32_t"), ("Int64", "int64_t"), ("UInt64", "uint64_t"), ("Boolean", "bool"), ("String", "const char *")] %}
EXPORT Status FMI(fmi3Get{{ t }})(void *c, const unsigned int r[], size_t n, {{ type }} v[], size_t m) { (void)c; (void)r; (void)v; (void)m; return (n == 0U) ? OK : ERROR; }
EXPORT Status FMI(fmi3Set{{ t }})(void *c, const unsigned int r[], size_t n, {{ type }} const v[], size_t m) { (void)c; (void)r; (void)v; (void)m; return (n == 0U) ? OK : ERROR; }
{% endfor %}
{% for f, types in [
    ("GetBinary", refs + ["size_t *", "const uint8_t **", "size_t"]),
    ("SetBinary", refs + ["const size_t *", "const uint8_t *const *", "size_t"]),
    ("GetClock", refs + ["bool *"]),
    ("SetClock", refs + ["const bool *"]),
    ("GetNumberOfVariableDependencies", ["unsigned int", "size_t *"]),
    ("GetVariableDependencies", ["unsigned int", "size_t *", "unsigned int *", "size_t *", "int *", "size_t"]),
    ("SerializedFMUStateSize", ["void *", "size_t *"]),
    ("SerializeFMUState", ["void *", "uint8_t *", "size_t"]),
    ("DeserializeFMUState", ["const uint8_t *", "size_t", "void **"]),
    ("GetDirectionalDerivative", refs + refs + ["const double *", "size_t", "double *", "size_t"]),
    ("GetAdjointDerivative", refs + refs + ["const double *", "size_t", "double *", "size_t"]),
    ("GetOutputDerivatives", refs + ["const int32_t *", "double *", "size_t"]),
    ("EnterConfigurationMode", []), ("ExitConfigurationMode", []), ("EnterEventMode", []), ("EnterStepMode", []),
    ("EnterContinuousTimeMode", []), ("EvaluateDiscreteStates", []),
    ("GetIntervalDecimal", refs + ["double *", "int *"]),
    ("GetIntervalFraction", refs + ["uint64_t *", "uint64_t *", "int *"]),
    ("GetShiftDecimal", refs + ["double *"]),
    ("GetShiftFraction", refs + ["uint64_t *", "uint64_t *"]),
    ("SetIntervalDecimal", refs + ["const double *"]),
    ("SetIntervalFraction", refs + ["const uint64_t *", "const uint64_t *"]),
    ("SetShiftDecimal", refs + ["const double *"]),
    ("SetShiftFraction", refs + ["const uint64_t *", "const uint64_t *"]),
    ("UpdateDiscreteStates", ["bool *", "bool *", "bool *", "bool *", "bool *", "double *"]),
    ("CompletedIntegratorStep", ["bool", "bool *", "bool *"]),
    ("SetTime", ["double"]),
    ("SetContinuousStates", ["const double *", "size_t"]),
    ("GetContinuousStateDerivatives", ["double *", "size_t"]),
    ("GetEventIndicators", ["double *", "size_t"]),
    ("GetContinuousStates", ["double *", "size_t"]),
    ("GetNominalsOfContinuousStates", ["double *", "size_t"]),
    ("GetNumberOfEventIndicators", ["size_t *"]),
    ("GetNumberOfContinuousStates", ["size_t *"]),
    ("ActivateModelPartition", ["unsigned int", "double"]),
] %}
EXPORT Status FMI(fmi3{{ f }})(void *c{% for t in types %}, {{ t }} a{{ loop.index }}{% endfor %}) { (void)c;{% for t in types %} (void)a{{ loop.index }};{% endfor %} return ERROR; }
{% endfor %}
