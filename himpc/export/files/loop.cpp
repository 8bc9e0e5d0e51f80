// The exported controller at the pace of its period with MuJoCo's C library as the robot. See README.md.
//
//   ./loop          in step with the clock
//   ./loop fast     as fast as possible
//
// Replace Robot by the interface of your arm: read, write.
#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>
#include <vector>

#include "himpc.h"

namespace {

using Clock = std::chrono::steady_clock;

std::vector<char> whole(const char *path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

struct Robot {
    mjModel *model;
    mjData *data;
    void read(double *q, double *v, double *tau) const {
        std::copy_n(data->qpos, HIMPC_N, q);
        std::copy_n(data->qvel, HIMPC_N, v);
        std::copy_n(data->ctrl, HIMPC_N, tau);
    }
    void write(const double *tau) {
        std::copy_n(tau, HIMPC_N, data->ctrl);
        mj_step(model, data);
    }
};

alignas(HIMPC_ALIGNMENT) char memory[HIMPC_BYTES];

}  // namespace

int main(int argc, char **argv) {
    const bool fast = argc > 1 && !std::strcmp(argv[1], "fast");
    const auto image = whole("controller.bin"), vector = whole("vector.bin");
    himpc_controller *c = himpc_create(memory, sizeof memory, image.data(), image.size());
    Robot robot{mj_loadModel("plant.mjb", nullptr), nullptr};
    if (!c || !robot.model || vector.size() < 16) {
        std::fprintf(stderr, "controller.bin, vector.bin or plant.mjb is missing or damaged, or does not belong to himpc.h\n");
        return 2;
    }
    robot.data = mj_makeData(robot.model);
    int64_t counts[2];
    std::memcpy(counts, vector.data(), sizeof counts);
    std::vector<double> numbers((vector.size() - sizeof counts) / sizeof(double));
    std::memcpy(numbers.data(), vector.data() + sizeof counts, numbers.size() * sizeof(double));
    const double *move = numbers.data(), *end = move + 11 * counts[1], *row = end;
    std::copy_n(row, HIMPC_N, robot.data->qpos);
    std::copy_n(row + HIMPC_N, HIMPC_N, robot.data->qvel);
    std::copy_n(row + 2 * HIMPC_N, HIMPC_N, robot.data->ctrl);

    double q[HIMPC_N], v[HIMPC_N], applied[HIMPC_N], tau[HIMPC_N], worst = 0.0, longest = 0.0, total = 0.0;
    int64_t late = 0, fallbacks = 0;
    const auto period = std::chrono::nanoseconds(std::llround(1e9 * HIMPC_PERIOD));
    auto next = Clock::now();
    for (int64_t k = 0; k < counts[0]; k++, row += 4 * HIMPC_N, next += period) {
        if (!fast) std::this_thread::sleep_until(next);
        for (; move < end && int64_t(move[0]) == k; move += 11)
            himpc_set(c, HIMPC_TARGET, int(move[1]), move + 3, int(move[2]));
        const auto begun = Clock::now();
        robot.read(q, v, applied);
        fallbacks += himpc_tick(c, q, v, applied, tau) != HIMPC_SOLVE;
        const double us = std::chrono::duration<double, std::micro>(Clock::now() - begun).count();
        robot.write(tau);
        late += !fast && Clock::now() > next + period;
        longest = std::max(longest, us);
        total += us;
        for (int a = 0; a < HIMPC_N; a++) worst = std::max(worst, std::fabs(tau[a] - row[3 * HIMPC_N + a]));
    }
    std::printf("%lld periods in closed loop: largest difference to Python %.1e N m; controller %.1f us, longest %.0f us; "
                "%lld cycles late, %lld with a fallback\n",
                (long long)counts[0], worst, total / double(counts[0]), longest, (long long)late, (long long)fallbacks);
    return worst <= 1e-3 ? 0 : 1;
}
