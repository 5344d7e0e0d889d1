#include <stdio.h>

#include "motor.h"

int main(void)
{
    const double voltages[] = {0.0, 1.0, 2.0, 2.0, 2.0};
    motor_state state;
    motor_init(&state);
    for (int k = 0; k < 5; k++) {
        printf("%.6f\n", motor_step(&state, voltages[k])); /* once a sample */
    }
    return 0;
}
