from motor import motor

model = motor()
print(round(model.step(0.0), 6), round(model.step(1.0), 6))  # sample by sample
model.reset()
print([round(speed, 6) for speed in model.simulate([0.0, 1.0, 2.0, 2.0, 2.0])])
