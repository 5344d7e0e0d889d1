import numpy as np
from flexure import Auto, Hammerstein

log = np.genfromtxt("motor.csv", delimiter=",", names=True)
u, y = log["voltage"], log["speed"]

model = Hammerstein().fit(u, y, dt=0.01)
print(model.verdict_)                      # does it hold on the last quarter?
print(model.nonlinearity_.breakpoints)     # kinks and jumps of the curve
print(model.linear_.poles)
print(f"fit of the whole record: {model.score(u, y):.4f}")

print(Auto().fit(u, y, dt=0.01).verdict_)  # the structure from the data too

model.save("model.json")                   # for flexure validate and predict
model.report("report.html")
