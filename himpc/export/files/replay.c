/* Replays a recorded run of the exported controller and prints the largest difference of a torque.

   ./replay            reads controller.bin and vector.bin in this folder
   ./replay hostile    gives the controller states that are not finite or far outside all limits */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "himpc.h"

enum { RUNS = 2, MOVE = 11 }; /* two controllers take turns; a move: tick, task, count, up to 8 numbers */

static struct { _Alignas(HIMPC_ALIGNMENT) char bytes[HIMPC_BYTES]; } memory[RUNS];

static void *whole(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    if (!file) return NULL;
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    void *data = malloc(*size + 64);
    size_t read = data ? fread(data, 1, *size, file) : 0;
    fclose(file);
    if (read == *size) return data;
    free(data);
    return NULL;
}

static double now_us(void) {
    struct timespec t;
    timespec_get(&t, TIME_UTC);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int hostile(himpc_controller *c, const double *q, const double *v) {
    const double wild[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e8, 1e4, 100.0, -100.0, 10.0, -10.0, 3.0, 0.0};
    const int count = (int)(sizeof wild / sizeof *wild);
    double x[HIMPC_N], y[HIMPC_N], z[HIMPC_N], tau[HIMPC_N];
    double longest = 0.0;
    int bad = 0, seen[HIMPC_HOLD + 1] = {0};
    uint32_t seed = 1;
    for (int k = 0; k < 500; k++) {
        for (int a = 0; a < HIMPC_N; a++) {
            uint32_t dice[3];
            for (int i = 0; i < 3; i++) dice[i] = (seed = seed * 1664525u + 1013904223u) >> 8;
            /* Long stretches of finite states far outside the limits, then single numbers that are not finite. */
            int far = k % 40 < 20, one = dice[2] % HIMPC_N == 0;
            x[a] = far || one ? wild[far ? 5 + dice[0] % 8 : dice[0] % (uint32_t)count] : q[a];
            y[a] = far || one ? wild[far ? 6 + dice[1] % 7 : dice[1] % (uint32_t)count] : v[a];
            z[a] = wild[dice[2] % (uint32_t)count];
            tau[a] = NAN;
        }
        double begun = now_us();
        int fallback = himpc_tick(c, x, y, k % 3 ? z : NULL, tau);
        double us = now_us() - begun;
        if (us > longest) longest = us;
        if (fallback < 0 || fallback > HIMPC_HOLD) bad++;
        else seen[fallback]++;
        for (int a = 0; a < HIMPC_N; a++)
            if (!(fabs(tau[a]) <= HIMPC_LARGEST_TORQUE[a] * (1.0 + 1e-12))) bad++;
    }
    printf("hostile states: %d torques outside the limits; fallbacks", bad);
    for (int k = 0; k <= HIMPC_HOLD; k++) printf(" %s %d", HIMPC_FALLBACKS[k], seen[k]);
    printf("\nlongest period %.0f us\n", longest);
    return bad ? 1 : 0;
}

static int replay(himpc_controller *const c[RUNS], const void *vector) {
    const int64_t *counts = vector; /* ticks, moves */
    const double *move = (const double *)vector + 2, *row = move + MOVE * counts[1];
    const double *moves_end = row;
    double worst = 0.0, tau[HIMPC_N], *us = calloc((size_t)counts[0] + 1, sizeof(double));
    if (!us) return 2;
    int fallbacks = 0;
    /* The second controller is one tick behind: neither may notice the other. */
    for (int64_t k = 0; k < counts[0]; k++, row += 4 * HIMPC_N) {
        for (; move < moves_end && (int64_t)move[0] == k; move += MOVE)
            for (int i = 0; i < RUNS; i++)
                if (himpc_set(c[i], HIMPC_TARGET, (int)move[1], move + 3, (int)move[2])) worst = INFINITY;
        for (int i = 0; i < RUNS; i++) {
            double begun = now_us();
            int fallback = himpc_tick(c[i], row, row + HIMPC_N, row + 2 * HIMPC_N, tau);
            if (i == 0) us[k] = now_us() - begun, fallbacks += fallback != 0;
            for (int a = 0; a < HIMPC_N; a++) {
                double difference = fabs(tau[a] - row[3 * HIMPC_N + a]);
                if (!(difference <= worst)) worst = difference;
            }
        }
    }
    qsort(us, (size_t)counts[0], sizeof(double), ascending);
    printf("%lld ticks: largest difference %.1e N m, median %.1f us a tick, longest %.0f us, %d ticks with a fallback\n",
           (long long)counts[0], worst, us[counts[0] / 2], us[counts[0] - 1], fallbacks);
    free(us);
    return worst <= 1e-6 ? 0 : 1;
}

int main(int argc, char **argv) {
    size_t size = 0, vector_size = 0;
    void *image = whole("controller.bin", &size), *vector = whole("vector.bin", &vector_size);
    himpc_controller *c[RUNS];
    int answer = 0;
    for (int k = 0; k < RUNS; k++)
        if (!image || !vector || !(c[k] = himpc_create(memory[k].bytes, HIMPC_BYTES, image, size))) answer = 2;
    if (answer)
        fprintf(stderr, "controller.bin or vector.bin is missing or damaged, or does not belong to himpc.h: export again\n");
    else if (argc > 1 && !strcmp(argv[1], "hostile")) {
        const double *row = (const double *)vector + 2 + MOVE * ((const int64_t *)vector)[1];
        answer = hostile(c[0], row, row + HIMPC_N);
    } else
        answer = replay(c, vector);
    free(image);
    free(vector);
    return answer;
}
