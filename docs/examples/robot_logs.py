import flexure

log = flexure.read("log.mcap", joint="elbow")
print({name: len(samples) for name, samples in log.items()})

joint = flexure.identify_joint("effort", position="position", data=log)
print(joint)
print(joint.best_friction.name, {name: str(p) for name, p in joint.best_friction.parameters.items()})

try:
    flexure.read("log.mcap")
except flexure.FileError as error:  # several topics: which one?
    print(error)
