/* Runs the physics steps of one policy step inside PyBullet's process: control, apply torques, step, read states.
 *
 * PyBullet loads this as a plugin, which gives the handle of its physics client; everything else goes through the C
 * functions that the PyBullet library exports. Only handles and plain numbers cross, so no Bullet header is needed. */
#include <stdint.h>

typedef void *Handle;

enum {
    SHARED_MEMORY_MAGIC_NUMBER = 202010061, /* what PyBullet 3.2.x wants its plugins to answer */
    TORQUE_CONTROL = 1, /* CONTROL_MODE_TORQUE */
    WORLD_FRAME = 2,    /* EF_WORLD_FRAME */
    BASE_NUMBERS = 7    /* position and quaternion stand before the joints in the generalised positions */
};

Handle b3InitStepSimulationCommand(Handle client);
int b3SubmitClientCommand(Handle client, Handle command); /* done on return: the server runs in this process */
Handle b3SubmitClientCommandAndWaitStatus(Handle client, Handle command);
Handle b3RequestActualStateCommandInit(Handle client, int body);
int b3GetStatusActualState(Handle status, int *body, int *n_q, int *n_v, const double *inertial_frame[],
                           const double *q[], const double *v[], const double *reactions[]);
Handle b3JointControlCommandInit2(Handle client, int body, int mode);
int b3JointControlSetDesiredForceTorque(Handle command, int dof, double torque);
Handle b3ApplyExternalForceCommandInit(Handle client);
void b3ApplyExternalForce(Handle command, int body, int link, const double force[3], const double position[3], int frame);
void b3ApplyExternalTorque(Handle command, int body, int link, const double torque[3], int frame);

typedef struct {
    Handle client;
    void *user;
} PluginContext;

typedef void (*Control)(int64_t step, double *q, double *v, double *torque, double *memory);

static Handle client_of_last_load;

int initPlugin_steps(PluginContext *context) {
    client_of_last_load = context->client;
    return SHARED_MEMORY_MAGIC_NUMBER;
}

void exitPlugin_steps(PluginContext *context) { (void)context; }

int executePluginCommand_steps(PluginContext *context, const void *arguments) {
    (void)context;
    (void)arguments;
    return 0;
}

Handle physics_client(void) { return client_of_last_load; }

/* Positions and velocities of a body, valid until the next command. */
static void read_body(Handle client, int body, const double **q, const double **v) {
    int id, n_q, n_v;
    const double *frame, *reactions;
    Handle status = b3SubmitClientCommandAndWaitStatus(client, b3RequestActualStateCommandInit(client, body));
    b3GetStatusActualState(status, &id, &n_q, &n_v, &frame, q, v, &reactions);
}

/* Reads the joints of all chains: q and v have n_chains * n_joints numbers. */
static void read_chains(Handle client, const int *chains, int n_chains, int n_joints, double *q, double *v) {
    for (int c = 0; c < n_chains; ++c) {
        const double *body_q, *body_v;
        read_body(client, chains[c], &body_q, &body_v);
        for (int j = 0; j < n_joints; ++j) {
            q[c * n_joints + j] = body_q[BASE_NUMBERS + j];
            v[c * n_joints + j] = body_v[BASE_NUMBERS - 1 + j];
        }
    }
}

static void apply_torques(Handle client, const int *chains, int n_chains, int n_joints, const double *torque) {
    for (int c = 0; c < n_chains; ++c) {
        Handle command = b3JointControlCommandInit2(client, chains[c], TORQUE_CONTROL);
        for (int j = 0; j < n_joints; ++j)
            b3JointControlSetDesiredForceTorque(command, BASE_NUMBERS - 1 + j, torque[c * n_joints + j]);
        b3SubmitClientCommand(client, command);
    }
}

/* Pose (7) and velocity (6) of the object, linear before angular, in the world frame. */
static void read_object(Handle client, int object, double *state) {
    const double *q, *v;
    read_body(client, object, &q, &v);
    for (int k = 0; k < 7; ++k) state[k] = q[k];
    for (int k = 0; k < 6; ++k) state[7 + k] = v[k];
}

/* Pushes the object at its centre with a force and a torque in the world frame. Two commands, because within one the
 * entries of PyBullet 3.2.7 overlap. */
static void push_object(Handle client, int object, const double *wrench, const double *state) {
    Handle command = b3ApplyExternalForceCommandInit(client);
    b3ApplyExternalForce(command, object, -1, wrench, state, WORLD_FRAME);
    b3SubmitClientCommand(client, command);
    command = b3ApplyExternalForceCommandInit(client);
    b3ApplyExternalTorque(command, object, -1, wrench + 3, WORLD_FRAME);
    b3SubmitClientCommand(client, command);
}

/* n_steps physics steps. q, v: states of all joints of all chains, current on entry and on
 * return. object: body of the object or -1; object_states: NULL, or its state (13 numbers) before each step and after
 * the last one; wrench: NULL or force and torque on it, for which object_states must be given. */
void run_physics_steps(Handle client, const int *chains, int n_chains, int n_joints, int64_t n_steps, Control control, double *q, double *v, double *torque, double *memory,
                       int object, const double *wrench, double *object_states) {
    for (int64_t i = 0; i < n_steps; ++i) {
        double *object_state = object_states ? object_states + 13 * i : 0;
        control(i, q, v, torque, memory);
        apply_torques(client, chains, n_chains, n_joints, torque);
        if (object_state) read_object(client, object, object_state);
        if (wrench) push_object(client, object, wrench, object_state);
        b3SubmitClientCommand(client, b3InitStepSimulationCommand(client));
        read_chains(client, chains, n_chains, n_joints, q, v);
    }
    if (object_states) read_object(client, object, object_states + 13 * n_steps);
}
