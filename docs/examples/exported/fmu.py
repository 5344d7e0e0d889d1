import fmpy
import numpy as np
from fmpy.validation import validate_fmu

print("complaints:", validate_fmu("motor.fmu"))
voltage = np.array(
    [(0.00, 0.0), (0.01, 1.0), (0.02, 2.0), (0.03, 2.0), (0.04, 2.0)], dtype=[("time", float), ("voltage", float)]
)
result = fmpy.simulate_fmu("motor.fmu", input=voltage, stop_time=0.05, output_interval=0.01)
for time, speed in result:
    print(f"after {time:.2f} s: {speed:.6f}")
