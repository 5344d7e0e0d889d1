import numpy as np
from flexure import Auto, Hammerstein

log = np.genfromtxt("motor.csv", delimiter=",", names=True)    # columns t, voltage, speed
u, y = log["voltage"], log["speed"]

model = Hammerstein().fit(u, y, dt=0.01)
print(model.verdict_)                                          # does the model hold on the last quarter?
print(model.nonlinearity_.breakpoints)                         # where the curve has kinks and jumps
print(model.linear_.poles)
print(f"fit of the whole record: {model.score(u, y):.4f}")

print(Auto().fit(u, y, dt=0.01).verdict_)                      # the structure comes from the data too

model.save("model.json")                                       # flexure validate and predict read it
model.report("report.html")
