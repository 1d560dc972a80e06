// The other side of the measurement: what the memory of this machine can do, and plain loops over the blocked layout of the model file.
// Reads one command a line, "job threads samples", and answers with the seconds of every sample and the sum of the result.
// Usage: peer vertices identity_dim pose_dim. The coefficients are those of workload.rs.
#include <immintrin.h>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

static double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
static float noise(uint32_t k) {
    k = (k ^ 0x9e37u) * 0x85ebca6bu; k = (k ^ (k >> 13)) * 0xc2b2ae35u; return float(k >> 8) / 8388608.0f - 1.0f;
}

// --- limits: every byte once, at the widest loads and stores -------------------------------------------------------------------------------
static volatile float sink;
static float read_sum(const float* p, size_t n) {
    __m256 a[8];
    #pragma GCC unroll 8
    for (int k = 0; k < 8; k++) a[k] = _mm256_setzero_ps();
    for (size_t i = 0; i + 64 <= n; i += 64)
        #pragma GCC unroll 8
        for (int k = 0; k < 8; k++) a[k] = _mm256_add_ps(a[k], _mm256_load_ps(p + i + 8 * k));
    for (int k = 1; k < 8; k++) a[0] = _mm256_add_ps(a[0], a[k]);
    return a[0][0];
}
// Reads a block's coefficients and writes its results, nothing else: the mix of reads and ordinary stores of value + Jacobian.
static void read_and_write(const float* p, size_t terms, float* out, size_t columns, size_t blocks) {
    for (size_t b = 0; b < blocks; b++) {
        __m256 s = _mm256_set1_ps(read_sum(p + b * terms * 48, terms * 48));
        for (size_t i = 0; i < columns * 48; i += 8) _mm256_store_ps(out + b * columns * 48 + i, s);
    }
}

// --- plain loops over the layout [block][term][3][16], left to the compiler ------------------------------------------------------------------
static void full(const float* c, size_t from, size_t to, size_t n, size_t di, size_t dp, const float* x, const float* y, float* out) {
    for (size_t b = from; b < to; b++) {
        const float* p = c + b * (1 + di * dp) * 48;
        float v[48];
        for (int l = 0; l < 48; l++) v[l] = p[l];
        p += 48;
        for (size_t i = 0; i < di; i++) {
            float t[48] = {};
            for (size_t j = 0; j < dp; j++, p += 48)
                for (int l = 0; l < 48; l++) t[l] += y[j] * p[l];
            for (int l = 0; l < 48; l++) v[l] += x[i] * t[l];
        }
        for (size_t l = 0; l < 16 && b * 16 + l < n; l++)
            for (int k = 0; k < 3; k++) out[3 * (b * 16 + l) + k] = v[16 * k + l];
    }
}
static void fixed(const float* c, size_t from, size_t to, size_t n, size_t d, const float* w, float* out) {
    for (size_t b = from; b < to; b++) {
        const float* p = c + b * (1 + d) * 48;
        float v[48];
        for (int l = 0; l < 48; l++) v[l] = p[l];
        p += 48;
        for (size_t j = 0; j < d; j++, p += 48)
            for (int l = 0; l < 48; l++) v[l] += w[j] * p[l];
        for (size_t l = 0; l < 16 && b * 16 + l < n; l++)
            for (int k = 0; k < 3; k++) out[3 * (b * 16 + l) + k] = v[16 * k + l];
    }
}
static void jacobian(const float* c, size_t from, size_t to, size_t di, size_t dp, const float* x, const float* y, float* values, float* jac) {
    for (size_t b = from; b < to; b++) {
        const float* p = c + b * (1 + di * dp) * 48;
        float v[48];
        for (int l = 0; l < 48; l++) v[l] = p[l];
        p += 48;
        float *by_x = jac + b * (di + dp) * 48, *by_y = by_x + di * 48;
        for (size_t l = 0; l < dp * 48; l++) by_y[l] = 0;
        for (size_t i = 0; i < di; i++) {
            float t[48] = {};
            for (size_t j = 0; j < dp; j++, p += 48)
                for (int l = 0; l < 48; l++) { t[l] += y[j] * p[l]; by_y[48 * j + l] += x[i] * p[l]; }
            for (int l = 0; l < 48; l++) { v[l] += x[i] * t[l]; by_x[48 * i + l] = t[l]; }
        }
        for (int l = 0; l < 48; l++) values[48 * b + l] = v[l];
    }
}

static float* numbers(size_t n) { float* p = (float*)aligned_alloc(64, (n * 4 + 63) / 64 * 64); memset(p, 0, n * 4); return p; }

// work(thread, threads) on all threads at once, from the first start to the last end.
template <class F> static std::vector<double> seconds(int threads, int samples, F work) {
    std::vector<std::vector<double>> start(threads, std::vector<double>(samples)), end = start;
    std::atomic<int> ready{0};
    auto body = [&](int id) {
        for (int s = 0; s < samples; s++) {
            if (threads > 1) { ready++; while (ready < threads * (s + 1)) std::this_thread::yield(); }
            start[id][s] = now(); work(id, s); end[id][s] = now();
        }
    };
    std::vector<std::thread> others;
    for (int id = 1; id < threads; id++) others.emplace_back(body, id);
    body(0);
    for (auto& other : others) other.join();
    std::vector<double> out(samples);
    for (int s = 0; s < samples; s++) {
        double first = start[0][s], last = end[0][s];
        for (int id = 1; id < threads; id++) { first = std::min(first, start[id][s]); last = std::max(last, end[id][s]); }
        out[s] = last - first;
    }
    return out;
}

int main(int, char** argv) {
    const size_t n = atol(argv[1]), di = atol(argv[2]), dp = atol(argv[3]), blocks = (n + 15) / 16, terms = 1 + di * dp;
    const size_t total = blocks * terms * 48, prepared = blocks * (1 + dp) * 48;
    float *c = numbers(total), *out = numbers(blocks * 48), *jac = numbers(blocks * (di + dp) * 48), *columns = numbers(prepared);
    for (size_t b = 0; b < blocks; b++)
        for (size_t k = 0; k < terms * 48; k++) {
            size_t at = b * terms * 48 + k;
            c[at] = b * 16 + k % 16 < n ? (k < 48 ? 100.0f : 1.0f) * noise(uint32_t(at)) : 0.0f;
        }
    std::vector<float> x(di), y(dp);
    for (size_t i = 0; i < di; i++) x[i] = noise(uint32_t(1000000 + i));
    for (size_t j = 0; j < dp; j++) y[j] = noise(uint32_t(2000000 + j));
    for (size_t b = 0; b < blocks; b++) {  // identity fixed: offset and columns summed once
        float *to = columns + b * (1 + dp) * 48, *from = c + b * terms * 48;
        for (int l = 0; l < 48; l++) to[l] = from[l];
        for (size_t i = 0; i < di; i++)
            for (size_t l = 0; l < dp * 48; l++) to[48 + l] += x[i] * from[48 + i * dp * 48 + l];
    }
    printf("ready\n"); fflush(stdout);
    char job[32]; int threads, samples; size_t walked = 0;
    while (scanf("%31s %d %d", job, &threads, &samples) == 3) {
        std::string name = job;
        auto edge = [&](int id) { return blocks * id / threads; };
        std::vector<double> t; double sum = 0; size_t bytes = 0;
        if (name == "read" || name == "read_fixed" || name == "read_pieces") {
            // A sample is the whole set, or a piece of 8 MiB that walks through the set: short enough to find the machine undisturbed.
            const float* set = name == "read_fixed" ? columns : c;
            size_t all = (name == "read_fixed" ? prepared : total) / 64 * 64, own = all / threads / 64 * 64, piece = std::min(own, size_t(8u << 18));
            if (name != "read_pieces") piece = own;
            size_t steps = own / piece, first = walked; walked += samples;
            t = seconds(threads, samples, [&](int id, int s) { sink = read_sum(set + id * own + (first + s) % steps * piece, piece); });
            bytes = 4 * piece * threads;
        } else if (name == "mix") {
            t = seconds(threads, samples, [&](int id, int) {
                size_t b = edge(id), m = edge(id + 1) - b; read_and_write(c + b * terms * 48, terms, jac + b * (di + dp) * 48, di + dp, m); });
            bytes = 4 * (total + blocks * (di + dp) * 48);
        } else if (name == "full" || name == "fixed") {
            t = seconds(threads, samples, [&](int id, int) {
                if (name == "full") full(c, edge(id), edge(id + 1), n, di, dp, x.data(), y.data(), out);
                else fixed(columns, edge(id), edge(id + 1), n, dp, y.data(), out); });
            for (size_t k = 0; k < 3 * n; k++) sum += out[k];
        } else {
            t = seconds(threads, samples, [&](int id, int) { jacobian(c, edge(id), edge(id + 1), di, dp, x.data(), y.data(), out, jac); });
            for (size_t k = 0; k < blocks * (di + dp) * 48; k++) sum += jac[k];
        }
        printf("%zu %.9g", bytes, sum);
        for (double s : t) printf(" %.9g", s);
        printf("\n"); fflush(stdout);
    }
}
