/* Runs the physics steps of one policy step in MuJoCo: control, step, and the object's states if wanted.
 *
 * Positions, velocities and applied torques are MuJoCo's own arrays, so nothing is copied; model and data stay handles. */
#include <stdint.h>
#include <string.h>

typedef void (*Control)(int64_t step, double *q, double *v, double *torque, double *memory);
typedef void (*Step)(const void *model, void *data);

enum { POSE = 7, TWIST = 6, STATE = POSE + TWIST };

static void read_object(const double *pose, const double *twist, double *state) {
    memcpy(state, pose, POSE * sizeof(double));
    memcpy(state + POSE, twist, TWIST * sizeof(double));
}

/* n_steps physics steps. q, v, torque: of all joints; the object's free joint follows them in q and v at `dofs`.
 * object_states: NULL, or its state (13 numbers, as MuJoCo has them) before each step and after the last one. */
void run_mujoco_steps(Step step, const void *model, void *data, int64_t n_steps, int64_t dofs, Control control,
                      double *q, double *v, double *torque, double *memory, double *object_states) {
    for (int64_t i = 0; i < n_steps; ++i) {
        if (object_states) read_object(q + dofs, v + dofs, object_states + STATE * i);
        control(i, q, v, torque, memory);
        step(model, data);
    }
    if (object_states) read_object(q + dofs, v + dofs, object_states + STATE * n_steps);
}
