import numpy as np
import onnxruntime

session = onnxruntime.InferenceSession("motor.onnx")
voltage = np.array([0.0, 1.0, 2.0, 2.0, 2.0])
(speed,) = session.run(["y"], {"u": voltage.reshape(-1, 1)})
print(speed.round(6).tolist())
