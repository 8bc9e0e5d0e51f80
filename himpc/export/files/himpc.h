/* @controller@ of @robot@: a controller for a loop with a period of @period@ s. Written by himpc-lab export.

   Units: rad and N m of revolute joints (m and N of prismatic ones), m, s; world frame. Joints: @joints@.
   Nothing allocates, no function keeps anything outside a controller's memory; several controllers may be used in
   several threads, each by one at a time. Only libm is needed. C99, C++11. */
#ifdef HIMPC_H
#if HIMPC_DIGEST != @digest@
#error "two exported controllers have the prefix himpc: export one of them with --prefix"
#endif
#else
#define HIMPC_H
/* The digest of controller.bin: of robot, joints, tasks and all numbers. */
#define HIMPC_DIGEST @digest@

#include <math.h>
#include <stddef.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    HIMPC_N = @n@,         /* joints */
    HIMPC_HORIZON = @horizon@,    /* knots */
    HIMPC_BYTES = @bytes@, /* of a controller's memory */
    HIMPC_ALIGNMENT = 64,
    HIMPC_LIMIT_MULTIPLE = @multiple@ /* largest limits of torque and velocity, in multiples of the robot's own */
};
#define HIMPC_PERIOD @period@ /* s */

/* A controller: HIMPC_BYTES bytes that begin at a multiple of HIMPC_ALIGNMENT. A copy of the bytes is a controller of
   its own. */
typedef struct himpc_controller himpc_controller;

/* Which fallback gave the torque; what acts in each is told in README.md. */
enum { @fallbacks@ };
static const char *const HIMPC_FALLBACKS[] = { @fallback_names@ };

/* What a setter answers. */
enum {
    HIMPC_OK = 0,
    HIMPC_FIXED = -1,       /* the task follows a fixed motion */
    HIMPC_MISFIT = -2,      /* no such task or level, or another number of values */
    HIMPC_NOT_USABLE = -3,  /* a value is not finite or out of range */
    HIMPC_NO_HIERARCHY = -4 /* this controller has no strict hierarchy */
};

/* What is wrong with an image. */
enum {
    HIMPC_OTHER_KERNEL = -1,     /* it is no image, or an image for another kernel */
    HIMPC_OTHER_CONTROLLER = -2, /* its robot, joints, tasks or settings are others */
    HIMPC_DAMAGED = -3           /* a bit is wrong */
};

/* One period: the torque tau (N m) to apply from now on. q (rad), v (rad/s): measured; tau_applied (N m): the torque
   that acted during the last period, NULL: that of the last call. HIMPC_N numbers each. For every state, also one
   that is not finite, tau is finite and within the limits in force. Returns which fallback acted, HIMPC_SOLVE if
   none was needed. */
int himpc_tick(himpc_controller *c, const double *q, const double *v, const double *tau_applied, double *tau);
/* Forgets everything but the settings. tau (N m): the torque that acts now; NULL: none. */
int himpc_reset(himpc_controller *c, const double *tau);
/* Changes a setting; himpc_set_... below are easier to use. */
int himpc_set(himpc_controller *c, int what, int index, const double *values, int count);
/* 0 if these bytes are the image with this digest (HIMPC_DIGEST), all bits of it, and this kernel can run it;
   else what is wrong. A controller that has run is no image any more. */
int himpc_check(const void *image, unsigned size, unsigned long long digest);

enum { HIMPC_TARGET, HIMPC_M_BAR, HIMPC_GAINS, HIMPC_WEIGHT_Q, HIMPC_WEIGHT_R, HIMPC_LIMITS, HIMPC_ENABLED,
       HIMPC_ORDER, HIMPC_WEIGHTS, HIMPC_BUDGET, HIMPC_OBJECT };

/* Tasks: @tasks@. */
enum { HIMPC_TASKS = @task_count@ };
static const char *const HIMPC_TASK_NAMES[] = { @task_names@ };
static const int HIMPC_TASK_ROWS[] = { @task_rows@ };
static const int HIMPC_TASK_FIRST[] = { @task_first@ };
/* Levels, highest priority first: @levels@. */
enum { HIMPC_LEVELS = @level_count@ };
static const char *const HIMPC_LEVEL_NAMES[] = { @level_names@ };
static const int HIMPC_LEVEL_ROWS[] = { @level_rows@ };
/* N m: no torque is ever larger, unless himpc_set_limits raises the limits. The robot's own limits times
   HIMPC_LIMIT_MULTIPLE are the most that it accepts. */
static const double HIMPC_LARGEST_TORQUE[HIMPC_N] = { @torques@ };

/* A controller in `memory` of HIMPC_BYTES bytes, from the content of controller.bin; NULL if it does not fit, see
   himpc_check. */
static inline himpc_controller *himpc_create(void *memory, size_t size, const void *image, size_t image_size) {
    if (image_size < HIMPC_BYTES || size < HIMPC_BYTES || (size_t)memory % HIMPC_ALIGNMENT) return NULL;
    if (himpc_check(image, HIMPC_BYTES, HIMPC_DIGEST)) return NULL;
    memcpy(memory, image, HIMPC_BYTES);
    himpc_reset((himpc_controller *)memory, NULL);
    return (himpc_controller *)memory;
}

static inline int himpc_task(const char *name) {
    for (int k = 0; k < HIMPC_TASKS; k++)
        if (!strcmp(name, HIMPC_TASK_NAMES[k])) return k;
    return -1;
}

static inline int himpc_level(const char *name) {
    for (int k = 0; k < HIMPC_LEVELS; k++)
        if (!strcmp(name, HIMPC_LEVEL_NAMES[k])) return k;
    return -1;
}

/* Drags the target of a task to x (m); coordinates that the task does not control are not used. */
static inline int himpc_set_position(himpc_controller *c, const char *task, const double x[3]) {
    return himpc_set(c, HIMPC_TARGET, himpc_task(task), x, 3);
}
/* Drags the target of a task to a unit quaternion x y z w. */
static inline int himpc_set_orientation(himpc_controller *c, const char *task, const double quaternion[4]) {
    return himpc_set(c, HIMPC_TARGET, himpc_task(task), quaternion, 4);
}
/* Drags the joints of a task to q (rad), one number per row of the task. */
static inline int himpc_set_joints(himpc_controller *c, const char *task, const double *q) {
    int k = himpc_task(task);
    return k < 0 ? HIMPC_MISFIT : himpc_set(c, HIMPC_TARGET, k, q, HIMPC_TASK_ROWS[k]);
}
/* The diagonal of M-bar, kg m^2. */
static inline int himpc_set_M_bar(himpc_controller *c, const double M_bar[HIMPC_N]) {
    return himpc_set(c, HIMPC_M_BAR, 0, M_bar, HIMPC_N);
}
/* Gains of a task, the same for all of its rows: K_p (1/s^2), K_v (1/s). */
static inline int himpc_set_gains(himpc_controller *c, const char *task, double K_p, double K_v) {
    double values[2 * @most_rows@];
    int k = himpc_task(task);
    if (k < 0) return HIMPC_MISFIT;
    for (int i = 0; i < HIMPC_TASK_ROWS[k]; i++) values[i] = K_p, values[HIMPC_TASK_ROWS[k] + i] = K_v;
    return himpc_set(c, HIMPC_GAINS, k, values, 2 * HIMPC_TASK_ROWS[k]);
}
/* Weights of (31) of a level, the same for all of its rows and all joints: Q, R. A controller without a strict
   hierarchy has one R: there use himpc_set with HIMPC_WEIGHT_Q. */
static inline int himpc_set_weights(himpc_controller *c, const char *level, double Q, double R) {
    double values[2 * @most_rows@];
    int k = himpc_level(level);
    if (k < 0) return HIMPC_MISFIT;
    for (int i = 0; i < HIMPC_LEVEL_ROWS[k] + HIMPC_N; i++) values[i] = i < HIMPC_LEVEL_ROWS[k] ? Q : R;
    return himpc_set(c, HIMPC_WEIGHTS, k, values, HIMPC_LEVEL_ROWS[k] + HIMPC_N);
}
/* The largest number of multiplications for changes of active rows in a period: it bounds the time of a period, since
   no clock is read. If it is used up, fallbacks act. */
static inline int himpc_set_budget(himpc_controller *c, double multiplications) {
    return himpc_set(c, HIMPC_BUDGET, 0, &multiplications, 1);
}
/* Limits of torque (N m), velocity (rad/s) and position (rad). Those in force close in on tighter ones gently. Refused
   are numbers that are not finite, torques and velocities above HIMPC_LIMIT_MULTIPLE times the robot's own, and
   positions outside the robot's own range. Only a joint without limits of position may have infinite ones. */
static inline int himpc_set_limits(himpc_controller *c, const double torque[HIMPC_N], const double velocity[HIMPC_N],
                                   const double lower[HIMPC_N], const double upper[HIMPC_N]) {
    double values[4 * HIMPC_N];
    memcpy(values, torque, sizeof(double) * HIMPC_N);
    memcpy(values + HIMPC_N, velocity, sizeof(double) * HIMPC_N);
    memcpy(values + 2 * HIMPC_N, lower, sizeof(double) * HIMPC_N);
    memcpy(values + 3 * HIMPC_N, upper, sizeof(double) * HIMPC_N);
    return himpc_set(c, HIMPC_LIMITS, 0, values, 4 * HIMPC_N);
}
/* Switches a level on (1), then its weight grows from nothing in half a second, or off (0). */
static inline int himpc_enable(himpc_controller *c, const char *level, int on) {
    double value = on;
    return himpc_set(c, HIMPC_ENABLED, himpc_level(level), &value, 1);
}

/* Gives the levels another order: all names, highest priority first. A level named damping stays the last. */
static inline int himpc_set_order(himpc_controller *c, const char *const levels[HIMPC_LEVELS]) {
    double values[HIMPC_LEVELS];
    for (int i = 0; i < HIMPC_LEVELS; i++) values[i] = himpc_level(levels[i]);
    return himpc_set(c, HIMPC_ORDER, 0, values, HIMPC_LEVELS);
}

/* Moves an object that the controller knows, an index of the objects in controller.json: x y z (m; the centre, of a
   post its foot, of a floor a point of its surface), the turn about the vertical (rad), and the velocity (m/s). */
static inline int himpc_set_object(himpc_controller *c, int object, const double place[4], const double velocity[3]) {
    double values[7] = {place[0], place[1], place[2], place[3], velocity[0], velocity[1], velocity[2]};
    return himpc_set(c, HIMPC_OBJECT, object, values, 7);
}

/* What the last period found. After HIMPC_HOLD these are the results of an earlier period.
   The error of each row of a task (m, rad), HIMPC_TASK_ROWS numbers; NULL: there is no such task. */
static inline const double *himpc_error(const himpc_controller *c, const char *task) {
    int k = himpc_task(task);
    return k < 0 ? NULL : (const double *)((const char *)c + @error@) + HIMPC_TASK_FIRST[k];
}
/* Number of active rows of a level; -1: there is no such level, or it is off. */
static inline int himpc_active_rows(const himpc_controller *c, const char *level) {
    int k = himpc_level(level), solved = k < 0 ? -1 : (int)((const double *)((const char *)c + @solved_index@))[k];
    return solved < 0 ? -1 : (int)((const double *)((const char *)c + @active@))[solved];
}
/* Which fallback gave the increments of a level; -1: there is no such level, or it is off. */
static inline int himpc_level_fallback(const himpc_controller *c, const char *level) {
    int k = himpc_level(level), solved = k < 0 ? -1 : (int)((const double *)((const char *)c + @solved_index@))[k];
    return solved < 0 ? -1 : (int)((const double *)((const char *)c + @fallback@))[solved];
}

#ifdef __cplusplus
}
#endif
#endif
