// The other side of the rows of evaluation: loops over our own layout left to the compiler, the same jobs by Eigen and by loops over vertices,
// lifting in place, and what the memory can do. Answers "job threads samples" as peer.cpp does; only loops over our layout and reads have threads.
// Usage: peers FILE, whose arrays `evaluation.rs` has written in the order in which they are read here.
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>
using namespace Eigen;
typedef Matrix<float, Dynamic, Dynamic, RowMajor> Rows;
static double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
static std::ifstream file;
template <class T> static std::vector<T> array() {
    uint64_t n; file.read((char*)&n, 8);
    std::vector<T> v(n); file.read((char*)v.data(), n * sizeof(T));
    return v;
}
static volatile float sink;
// As workload.rs has it.
static float noise(uint32_t k) {
    k = (k ^ 0x9e37u) * 0x85ebca6bu; k = (k ^ (k >> 13)) * 0xc2b2ae35u; return float(k >> 8) / 8388608.0f - 1.0f;
}

// A rest shape of d components and the motions of its joints.
struct Body {
    std::vector<float> mean, basis, place, slope, weight, z, angles, block_weights;
    std::vector<int> parent, held, starts, joints;
    int n, J, blocks;
    std::vector<float> motions, rest, out;
    std::map<int, std::vector<float>> blocked;  // [block][1 + d][3][16]
    std::map<int, Rows> matrix, slopes;
    void read() {
        mean = array<float>(); basis = array<float>(); place = array<float>(); slope = array<float>(); weight = array<float>(); z = array<float>();
        angles = array<float>(); block_weights = array<float>(); parent = array<int>(); held = array<int>(); starts = array<int>(); joints = array<int>();
        n = mean.size() / 3; J = parent.size(); blocks = (n + 15) / 16;
        motions.resize(12 * J); rest.resize(48 * blocks); out.resize(3 * n);
        for (int d : {20, 100}) {
            auto& c = blocked[d]; c.assign(size_t(blocks) * (1 + d) * 48, 0.f);
            for (int v = 0; v < n; v++) for (int k = 0; k <= d; k++) for (int a = 0; a < 3; a++)
                c[(size_t(v / 16) * (1 + d) + k) * 48 + 16 * a + v % 16] = k ? basis[size_t(3 * v + a) * 100 + k - 1] : mean[3 * v + a];
            matrix[d] = Map<Rows>(basis.data(), 3 * n, 100).leftCols(d); slopes[d] = Map<Rows>(slope.data(), 3 * J, 100).leftCols(d);
        }
    }
    void pose(int d) {
        VectorXf p = Map<VectorXf>(place.data(), 3 * J);
        if (d) p += slopes[d] * Map<VectorXf>(z.data(), d);
        for (int j = 0; j < J; j++) {
            Vector3f turn = Map<Vector3f>(&angles[3 * j]), at = p.segment<3>(3 * j); float angle = turn.norm();
            Matrix3f own = angle > 0 ? AngleAxisf(angle, turn / angle).toRotationMatrix() : Matrix3f(Matrix3f::Identity());
            Matrix<float, 3, 4> local; local.leftCols<3>() = own; local.col(3) = at - own * at;
            Map<Matrix<float, 3, 4, RowMajor>> to(&motions[12 * j]);
            if (parent[j] < 0) { to = local; continue; }
            Map<Matrix<float, 3, 4, RowMajor>> up(&motions[12 * parent[j]]);
            Matrix<float, 3, 4> both; both.leftCols<3>() = up.leftCols<3>() * local.leftCols<3>();
            both.col(3) = up.leftCols<3>() * local.col(3) + up.col(3); to = both;
        }
    }
    // One vertex after another, a blended matrix for each.
    void skin_vertices(const float* v) {
        const float *w = weight.data(), *motion = motions.data(); const int* bone = held.data(); float* to = out.data();
        for (int i = 0; i < n; i++) {
            float m[12] = {}, x = v[3 * i], y = v[3 * i + 1], z = v[3 * i + 2];
            for (int k = 4 * i; k < 4 * i + 4; k++) { const float* of = motion + 12 * bone[k]; for (int e = 0; e < 12; e++) m[e] += w[k] * of[e]; }
            for (int a = 0; a < 3; a++) to[3 * i + a] = m[4 * a] * x + m[4 * a + 1] * y + m[4 * a + 2] * z + m[4 * a + 3];
        }
    }
    void eigen(int d) {
        pose(d); VectorXf v = Map<VectorXf>(mean.data(), 3 * n);
        if (d) v.noalias() += matrix[d] * Map<VectorXf>(z.data(), d);
        skin_vertices(v.data());
    }
    // Block after block over the layout of the file.
    void plain(int d, int part, int parts) {
        const float* c = d ? blocked[d].data() : rest.data();
        for (int b = blocks * part / parts; b < blocks * (part + 1) / parts; b++) {
            float v[48], x[48] = {};
            const float* p = c + size_t(b) * (1 + d) * 48;
            for (int l = 0; l < 48; l++) v[l] = p[l];
            for (int k = 0; k < d; k++) { p += 48; for (int l = 0; l < 48; l++) v[l] += z[k] * p[l]; }
            for (int e = starts[b]; e < starts[b + 1]; e++) {
                const float *m = &motions[12 * joints[e]], *w = &block_weights[16 * e];
                for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++)
                    x[16 * a + l] += w[l] * (m[4 * a] * v[l] + m[4 * a + 1] * v[16 + l] + m[4 * a + 2] * v[32 + l] + m[4 * a + 3]);
            }
            for (int l = 0; l < 16 && 16 * b + l < n; l++) for (int a = 0; a < 3; a++) out[3 * (16 * b + l) + a] = x[16 * a + l];
        }
    }
};

// 5996 vertices by 30 x 7: the blocked layout of the file, and rows of a matrix for Eigen.
struct Face {
    static const int n = 5996, di = 30, dp = 7, terms = 1 + di * dp, blocks = (n + 15) / 16;
    std::vector<float> c, columns, out, values, jacobian; Rows core, slopes; VectorXf mean, x, y, result; MatrixXf normal;
    void make() {
        c.assign(size_t(blocks) * terms * 48, 0.f); columns.assign(size_t(blocks) * (1 + dp) * 48, 0.f);
        out.resize(3 * n); values.resize(blocks * 48); jacobian.resize(size_t(blocks) * (di + dp) * 48);
        core.resize(3 * n, di * dp); slopes.resize(3 * n, di + dp); mean.resize(3 * n); result.resize(3 * n); x.resize(di); y.resize(dp);
        for (int i = 0; i < di; i++) x[i] = noise(1000000 + i);
        for (int j = 0; j < dp; j++) y[j] = noise(2000000 + j);
        for (size_t at = 0; at < c.size(); at++) {
            size_t b = at / (terms * 48), k = at % (terms * 48), v = b * 16 + k % 16, a = k % 48 / 16;
            if (v >= size_t(n)) continue;
            c[at] = (k < 48 ? 100.f : 1.f) * noise(at);
            if (k < 48) mean[3 * v + a] = c[at]; else core(3 * v + a, k / 48 - 1) = c[at];
        }
        for (int b = 0; b < blocks; b++) for (int k = 0; k < 48; k++) {
            const float* from = &c[size_t(b) * terms * 48 + k]; float* to = &columns[size_t(b) * (1 + dp) * 48 + k];
            to[0] = from[0];
            for (int j = 0; j < dp; j++) for (int i = 0; i < di; i++) to[48 * (1 + j)] += x[i] * from[48 * (1 + i * dp + j)];
        }
    }
    void store(int b, const float* v) { for (int l = 0; l < 16 && 16 * b + l < n; l++) for (int a = 0; a < 3; a++) out[3 * (16 * b + l) + a] = v[16 * a + l]; }
    void full(int from, int to) {
        for (int b = from; b < to; b++) {
            const float* p = &c[size_t(b) * terms * 48]; float v[48];
            for (int l = 0; l < 48; l++) v[l] = p[l];
            for (int i = 0; i < di; i++) {
                float t[48] = {};
                for (int j = 0; j < dp; j++) { p += 48; for (int l = 0; l < 48; l++) t[l] += y[j] * p[l]; }
                for (int l = 0; l < 48; l++) v[l] += x[i] * t[l];
            }
            store(b, v);
        }
    }
    void fixed(int from, int to) {
        for (int b = from; b < to; b++) {
            const float* p = &columns[size_t(b) * (1 + dp) * 48]; float v[48];
            for (int l = 0; l < 48; l++) v[l] = p[l];
            for (int j = 0; j < dp; j++) { p += 48; for (int l = 0; l < 48; l++) v[l] += y[j] * p[l]; }
            store(b, v);
        }
    }
    void derivatives(int from, int to) {
        for (int b = from; b < to; b++) {
            const float* p = &c[size_t(b) * terms * 48]; float v[48], *by_x = &jacobian[size_t(b) * (di + dp) * 48], *by_y = by_x + di * 48;
            for (int l = 0; l < 48; l++) v[l] = p[l];
            for (int l = 0; l < dp * 48; l++) by_y[l] = 0;
            for (int i = 0; i < di; i++) {
                float t[48] = {};
                for (int j = 0; j < dp; j++) { p += 48; for (int l = 0; l < 48; l++) { t[l] += y[j] * p[l]; by_y[48 * j + l] += x[i] * p[l]; } }
                for (int l = 0; l < 48; l++) { v[l] += x[i] * t[l]; by_x[48 * i + l] = t[l]; }
            }
            for (int l = 0; l < 48; l++) values[48 * b + l] = v[l];
        }
    }
    void gemv() {
        VectorXf k(di * dp);
        for (int i = 0; i < di; i++) k.segment(i * dp, dp) = x[i] * y;
        result.noalias() = mean + core * k;
    }
    void fused() {
        for (int r = 0; r < 3 * n; r++) {
            Map<const Rows> row(&core(r, 0), di, dp);
            slopes.row(r).head(di).noalias() = (row * y).transpose(); slopes.row(r).tail(dp).noalias() = x.transpose() * row;
            result[r] = mean[r] + slopes.row(r).head(di).dot(x);
        }
    }
    // The normal matrix of all products of weights once; then both groups in turn, in that space alone.
    void fit() {
        const int steps = 24; const VectorXf true_x = x, true_y = y;
        gemv(); VectorXf target = result - mean;
        MatrixXf g(di * dp, di * dp); g.setZero(); g.selfadjointView<Lower>().rankUpdate(core.transpose()); g.triangularView<StrictlyUpper>() = g.transpose();
        VectorXf h = core.transpose() * target; x.setConstant(0.2f); y.setConstant(0.2f);
        for (int s = 0; s < steps; s++) {
            MatrixXf by_y(di * dp, di), by_x(di * dp, dp); by_y.setZero();
            for (int i = 0; i < di; i++) by_y.block(i * dp, i, dp, 1) = y;
            x = (by_y.transpose() * g * by_y).ldlt().solve(by_y.transpose() * h);
            for (int i = 0; i < di; i++) by_x.block(i * dp, 0, dp, dp) = x[i] * MatrixXf::Identity(dp, dp);
            y = (by_x.transpose() * g * by_x).ldlt().solve(by_x.transpose() * h);
        }
        gemv(); x = true_x; y = true_y;
    }
    void equations() {
        fused(); normal.setZero(di + dp, di + dp); normal.selfadjointView<Lower>().rankUpdate(slopes.transpose()); sink = (slopes.transpose() * result)[0];
    }
};

// Cubic synthesis in place on (height, width, 3), finest lattice last; ends as in our transform. Whole rows where they are dense.
struct Lifting {
    std::vector<float> source, a; int w = 0, h = 0, levels = 0;
    void size(int l) { levels = l; w = (4 << l) + 1; h = (6 << l) + 1; }
    void read(int l) { size(l); source = array<float>(); }
    // to = scale * (to + f * p + g * q) for every coordinate of every s-th column.
    void combine(float* to, const float* p, const float* q, int s, float f, float g, float scale) const {
        if (s == 1) for (int i = 0; i < 3 * w; i++) to[i] = scale * (to[i] + f * p[i] + g * q[i]);
        else for (int i = 0; i < 3 * w; i += 3 * s) for (int k = i; k < i + 3; k++) to[k] = scale * (to[k] + f * p[k] + g * q[k]);
    }
    void down(int s) {
        auto row = [&](int y) { return &a[size_t(y) * w * 3]; };
        for (int y = 2 * s; y + 2 * s < h; y += 2 * s) combine(row(y), row(y - s), row(y + s), s, -0.375f, -0.375f, 0.5f);
        for (int y = s; y < h; y += 2 * s) combine(row(y), row(y - s), row(y + s), s, y == s ? 0.5f : 1.f, y + s == h - 1 ? 0.5f : 1.f, 1.f);
        for (int y = 2 * s; y + 2 * s < h; y += 2 * s) combine(row(y), row(y - s), row(y + s), s, 0.25f, 0.25f, 1.f);
    }
    void across(float* r, int s) const {
        const int d = 3 * s, last = 3 * (w - 1);
        for (int i = 2 * d; i < last; i += 2 * d) for (int k = i; k < i + 3; k++) r[k] = 0.5f * (r[k] - 0.375f * (r[k - d] + r[k + d]));
        for (int k = 0; k < 3; k++) r[d + k] += 0.5f * r[k] + (2 * d == last ? 0.5f : 1.f) * r[2 * d + k];
        for (int i = 3 * d; i + d < last; i += 2 * d) for (int k = i; k < i + 3; k++) r[k] += r[k - d] + r[k + d];
        if (2 * d < last) for (int k = last - d; k < last - d + 3; k++) r[k] += r[k - d] + 0.5f * r[k + d];
        for (int i = 2 * d; i < last; i += 2 * d) for (int k = i; k < i + 3; k++) r[k] += 0.25f * (r[k - d] + r[k + d]);
    }
    void lift() {
        for (int s = 1 << (levels - 1); s >= 1; s /= 2) {
            down(s);
            for (int y = 0; y < h; y += s) across(&a[size_t(y) * w * 3], s);
        }
    }
    void run() { a = source; lift(); }
};

// A bilinear model of 10 x 5 weights for each coefficient, then the synthesis.
struct Locals {
    static const int di = 10, dp = 5; Lifting grid; int n = 0;
    std::vector<float> mean, core, x, y; std::vector<int> place;  // core: coefficient, coordinate, weights
    void make() {
        grid.size(5); n = grid.w * grid.h; grid.a.resize(3 * n);
        mean.resize(3 * n); core.resize(size_t(3 * n) * di * dp); x.resize(n * di); y.resize(n * dp);
        for (int k = 0; k < 3 * n; k++) mean[k] = noise(7000000 + k);
        for (int t = 0; t < di * dp; t++) for (int k = 0; k < 3 * n; k++) core[size_t(k) * di * dp + t] = noise(7000000 + 3 * n * (1 + t) + k);
        for (int k = 0; k < n * di; k++) x[k] = noise(8000000 + k);
        for (int k = 0; k < n * dp; k++) y[k] = noise(9000000 + k);
        // Coefficients stand level by level, the base first, inside a level by rows of the finest grid.
        for (int level = 0; level <= 5; level++) {
            int s = 1 << (5 - level);
            for (int r = 0; r < grid.h; r += s) for (int c = 0; c < grid.w; c += s)
                if (level == 0 || r / s % 2 || c / s % 2) place.push_back(r * grid.w + c);
        }
    }
    void run() {
        for (int q = 0; q < n; q++) {
            float k[di * dp];
            for (int i = 0; i < di; i++) for (int j = 0; j < dp; j++) k[i * dp + j] = x[q * di + i] * y[q * dp + j];
            for (int a = 0; a < 3; a++) {
                const float* p = &core[size_t(3 * q + a) * di * dp]; float sum[2] = {mean[3 * q + a], 0};
                sum[1] = Map<const Matrix<float, di * dp, 1>>(p).dot(Map<Matrix<float, di * dp, 1>>(k));
                grid.a[3 * place[q] + a] = sum[0] + sum[1];
            }
        }
        grid.lift();
    }
};

static float read_sum(const float* v, size_t n) {
    float a[128] = {};
    for (size_t i = 0; i + 128 <= n; i += 128) for (int l = 0; l < 128; l++) a[l] += v[i + l];
    float s = 0; for (float x : a) s += x;
    return s;
}

// work(part, parts) on all threads at once, from the first start to the last end.
static std::vector<double> seconds(int threads, int samples, const std::function<void(int, int)>& work) {
    std::vector<std::vector<double>> start(threads, std::vector<double>(samples)), end = start;
    std::atomic<int> ready{0};
    auto body = [&](int id) {
        for (int s = 0; s < samples; s++) {
            if (threads > 1) { ready++; while (ready < threads * (s + 1)) std::this_thread::yield(); }
            start[id][s] = now(); work(id, threads); end[id][s] = now();
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
    file.open(argv[1], std::ios::binary);
    Body body; body.read();
    Face face; face.make();
    Lifting small, large; small.read(5); large.read(6);
    Locals locals; locals.make();
    auto points = array<float>();
    Map<Matrix3Xf> X(points.data(), 3, points.size() / 3);
    Matrix3Xf Y = ((1.1f * AngleAxisf(0.3f, Vector3f(1, 2, 3).normalized()).toRotationMatrix()) * X).colwise() + Vector3f(1, 2, 3);
    for (int i = 0; i < body.n; i++) for (int a = 0; a < 3; a++) body.rest[size_t(i / 16) * 48 + 16 * a + i % 16] = body.mean[3 * i + a];
    typedef std::function<void(int, int)> Work;
    // The motions of the joints belong to the job; one thread alone makes them.
    auto posed = [&](int d) { return [&body, d](int part, int parts) { if (part == 0) body.pose(d); body.plain(d, part, parts); }; };
    auto blocks = [&](void (Face::*job)(int, int)) {
        return [&face, job](int part, int parts) { (face.*job)(Face::blocks * part / parts, Face::blocks * (part + 1) / parts); };
    };
    auto whole = [](std::function<void()> job) { return [job](int, int) { job(); }; };
    struct Result { Work work; const float* numbers; size_t count; };
    auto on = [&](Work work, const std::vector<float>& out) { return Result{work, out.data(), out.size()}; };
    std::vector<float> none; small.a = small.source; large.a = large.source;
    std::map<std::string, Result> jobs = {
        {"skin_vertices", on(whole([&] { body.pose(0); body.skin_vertices(body.mean.data()); }), body.out)}, {"skin_blocks", on(posed(0), body.out)},
        {"body20_eigen", on(whole([&] { body.eigen(20); }), body.out)}, {"body20_blocks", on(posed(20), body.out)},
        {"body100_eigen", on(whole([&] { body.eigen(100); }), body.out)}, {"body100_blocks", on(posed(100), body.out)},
        {"face_blocks", on(blocks(&Face::full), face.out)}, {"face_fixed", on(blocks(&Face::fixed), face.out)},
        {"face_jacobian", on(blocks(&Face::derivatives), face.values)},
        {"face_eigen", {whole([&] { face.gemv(); }), face.result.data(), size_t(face.result.size())}},
        {"face_fused", {whole([&] { face.fused(); }), face.result.data(), size_t(face.result.size())}},
        {"face_fit", {whole([&] { face.fit(); }), face.result.data(), size_t(face.result.size())}},
        {"face_normal", on(whole([&] { face.equations(); }), none)},
        {"wavelet5", on(whole([&] { small.run(); }), small.a)}, {"wavelet6", on(whole([&] { large.run(); }), large.a)},
        {"locals", on(whole([&] { locals.run(); }), locals.grid.a)},
        {"rigid", on(whole([&] { sink = umeyama(X, Y, true)(0, 0); }), none)},
    };
    printf("ready Eigen %d.%d.%d\n", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION); fflush(stdout);
    char job[32]; int threads, samples; std::vector<float> set;
    while (scanf("%31s %d %d", job, &threads, &samples) == 3) {
        std::string name = job; std::vector<double> times; double sum = 0; size_t bytes = 0;
        if (name.rfind("read_", 0) == 0) {  // read_KILOBYTES
            set.assign(size_t(atol(job + 5)) * 256 / 256 * 256, 1.f); bytes = 4 * set.size();
            times = seconds(threads, samples, [&](int part, int parts) { size_t own = set.size() / parts; sink = read_sum(&set[part * own], own); });
        } else {
            Result& result = jobs.at(name);
            times = seconds(threads, samples, result.work);
            for (size_t i = 0; i < result.count; i++) sum += result.numbers[i];
        }
        printf("%zu %.9g", bytes, sum);
        for (double s : times) printf(" %.9g", s);
        printf("\n"); fflush(stdout);
    }
}
