// The other side of the rows of evaluation: loops over our own layout (plain.hpp), the same jobs by Eigen and by loops over vertices, lifting in
// place, and what the memory can do. Answers "job threads samples" as peer.cpp does; only loops over our layout and reads have threads.
// Usage: peers FILE, whose arrays `evaluation.rs` has written in the order in which they are read here.
#include "plain.hpp"
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
// A rest shape of d components and the motions of its joints.
struct Body {
    std::vector<float> mean, basis, place, slope, weight, z, angles;
    std::vector<int> parent, held;
    int n, J, blocks; Skin skin;
    std::vector<float> motions, out;
    std::map<int, std::vector<float>> blocked;  // [block][1 + d][3][16]
    std::map<int, Rows> matrix, slopes;
    void read() {
        mean = array<float>(); basis = array<float>(); place = array<float>(); slope = array<float>(); weight = array<float>(); z = array<float>();
        angles = array<float>(); skin.weights = array<float>(); parent = array<int>(); held = array<int>(); skin.starts = array<int>(); skin.joints = array<int>();
        n = mean.size() / 3; J = parent.size(); blocks = (n + 15) / 16;
        motions.resize(12 * J); out.resize(3 * n);
        for (int d : {0, 20, 100}) {
            auto& c = blocked[d]; c.assign(size_t(blocks) * (1 + d) * 48, 0.f);
            for (int v = 0; v < n; v++) for (int k = 0; k <= d; k++) for (int a = 0; a < 3; a++)
                c[(size_t(v / 16) * (1 + d) + k) * 48 + 16 * a + v % 16] = k ? basis[size_t(3 * v + a) * 100 + k - 1] : mean[3 * v + a];
            matrix[d] = Map<Rows>(basis.data(), 3 * n, 100).leftCols(d); slopes[d] = Map<Rows>(slope.data(), 3 * J, 100).leftCols(d);
        }
    }
    // The same over blocks.
    Bodies over_blocks(int d) {
        Bodies to; to.c = blocked[d].data(); to.z = z.data(); to.angles = angles.data(); to.place = place.data(); to.d = d; to.n = n; to.blocks = blocks;
        to.slopes = slopes[d]; to.parents = parent; to.skin = &skin; to.out.resize(3 * n);
        if (d == 0) return to;
        int dim = d + 3 * J; to.half.make(blocked[d], blocks, 1 + d); to.bytes.make(blocked[d], n, 1 + d); to.batched.resize(size_t(Bodies::batch) * 3 * n);
        to.values.resize(48 * blocks); to.jacobian.resize(size_t(48) * blocks * dim); to.gradient.resize(dim);
        for (int k = 0; k < 3 * n; k++) to.forces.push_back(noise(k));
        return to;
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
};

// 5996 vertices by 30 x 7: rows of a matrix for Eigen beside the blocks.
struct Face {
    static const int n = 5996, di = 30, dp = 7, terms = 1 + di * dp;
    Faces<n, di, dp> plain; Rows core, slopes; VectorXf mean, x, y, result; MatrixXf normal;
    void make() {
        plain.make(); plain.values.resize(plain.blocks * 48); plain.jacobian.resize(size_t(plain.blocks) * plain.dim * 48);
        core.resize(3 * n, di * dp); slopes.resize(3 * n, di + dp); mean.resize(3 * n); result.resize(3 * n); x = plain.x; y = plain.y;
        for (int v = 0; v < n; v++) for (int t = 0; t < terms; t++) for (int a = 0; a < 3; a++) {
            float value = plain.c[(size_t(v / 16) * terms + t) * 48 + 16 * a + v % 16];
            if (t == 0) mean[3 * v + a] = value; else core(3 * v + a, t - 1) = value;
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
    Face face; face.make(); auto& blocks = face.plain; std::vector<float> shifted;
    Faces<26719, 100, 25> large_face;
    Bodies still = body.over_blocks(0), twenty = body.over_blocks(20), hundred = body.over_blocks(100);
    Lifting small, large; small.read(5); large.read(6);
    Locals locals; locals.make(); Blocks models; models.make();
    Levels fine, finer; fine.size(5); finer.size(6); fine.coefficients = array<float>(); finer.coefficients = array<float>();
    auto points = array<float>();
    Map<Matrix3Xf> X(points.data(), 3, points.size() / 3);
    Matrix3Xf Y = ((1.1f * AngleAxisf(0.3f, Vector3f(1, 2, 3).normalized()).toRotationMatrix()) * X).colwise() + Vector3f(1, 2, 3);
    Moments moments; moments.p = points; moments.q.assign(Y.data(), Y.data() + Y.size()); moments.n = X.cols();
    typedef std::function<void(int, int)> Work;
    blocks.full(0, 1); for (float x : blocks.out) shifted.push_back(x + 0.1f);
    auto whole = [](auto job) { return Work([job](int, int) { job(); }); };
    // A job and where its result is.
    struct Result { Work work; const std::vector<float>* numbers; const VectorXf* eigen; };
    auto on = [](Work work, const std::vector<float>& out) { return Result{work, &out, nullptr}; };
    auto by_eigen = [&](auto job) { return Result{whole(job), nullptr, &face.result}; };
    // A member function of `of` on its part.
    auto split = [](auto& of, auto job) { return Work([&of, job](int part, int parts) { (of.*job)(part, parts); }); };
    auto stored = [](auto& of, auto& terms) { return Work([&](int part, int parts) { of.stored(terms, part, parts); }); };
    // What has one order of its sums is done whole by each thread, with data of its own.
    auto each = [](auto& one, auto& other, auto job) { return Work([&one, &other, job](int part, int) { job(part ? other : one); }); };
    auto second_blocks = blocks; Bodies second_twenty = twenty, second_hundred = hundred;
    std::vector<float> none; small.a = small.source; large.a = large.source;
    typedef Faces<26719, 100, 25> Large; typedef Faces<Face::n, Face::di, Face::dp> Small;
    std::map<std::string, Result> jobs = {
        {"skin_vertices", on(whole([&] { body.pose(0); body.skin_vertices(body.mean.data()); }), body.out)},
        {"skin_blocks", on(split(still, &Bodies::positions), still.out)}, {"skin_dual", on(split(still, &Bodies::dual), still.out)},
        {"face_blocks", on(split(blocks, &Small::full), blocks.out)}, {"face_fixed", on(split(blocks, &Small::fixed), blocks.out)},
        {"face_F16", on(stored(blocks, blocks.half), blocks.out)}, {"face_I8", on(stored(blocks, blocks.bytes), blocks.out)},
        {"face_jacobian", on(split(blocks, &Small::derivatives), blocks.jacobian)},
        {"face_equations", on(each(blocks, second_blocks, [&](auto& of) { of.equations(shifted); }), blocks.sums)},
        {"face_fit_blocks", on(each(blocks, second_blocks, [](auto& of) { of.fit(); }), blocks.out)},
        {"large_blocks", on(split(large_face, &Large::full), large_face.out)}, {"large_fixed", on(split(large_face, &Large::fixed), large_face.out)},
        {"large_F16", on(stored(large_face, large_face.half), large_face.out)}, {"large_I8", on(stored(large_face, large_face.bytes), large_face.out)},
        {"face_eigen", by_eigen([&] { face.gemv(); })}, {"face_fused", by_eigen([&] { face.fused(); })}, {"face_fit", by_eigen([&] { face.fit(); })},
        {"face_normal", on(whole([&] { face.equations(); }), none)},
        {"wavelet5", on(whole([&] { small.run(); }), small.a)}, {"wavelet6", on(whole([&] { large.run(); }), large.a)},
        {"levels5", on(split(fine, &Levels::run), fine.out)}, {"levels6", on(split(finer, &Levels::run), finer.out)},
        {"locals", on(whole([&] { locals.run(); }), locals.grid.a)}, {"locals_blocks", on(split(models, &Blocks::run), models.out)},
        {"rigid", on(whole([&] { sink = umeyama(X, Y, true)(0, 0); }), none)}, {"moments", on(whole([&] { sink = moments.run(); }), none)},
    };
    for (Bodies* of : {&twenty, &hundred}) {
        std::string name = "body" + std::to_string(of->d) + "_"; int d = of->d;
        jobs[name + "eigen"] = on(whole([&body, d] { body.eigen(d); }), body.out);
        jobs[name + "blocks"] = on(split(*of, &Bodies::positions), of->out);
        jobs[name + "F16"] = on(stored(*of, of->half), of->out); jobs[name + "I8"] = on(stored(*of, of->bytes), of->out);
        jobs[name + "batch"] = on(split(*of, &Bodies::together), of->batched);
        jobs[name + "jacobian"] = on(split(*of, &Bodies::derivatives), of->jacobian);
        Bodies& second = d == 20 ? second_twenty : second_hundred;
        jobs[name + "gradient"] = on(each(*of, second, [](auto& of) { of.reverse(); }), of->gradient);
    }
    printf("ready Eigen %d.%d.%d\n", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION); fflush(stdout);
    char job[32]; int threads, samples; std::vector<float> set;
    while (scanf("%31s %d %d", job, &threads, &samples) == 3) {
        std::string name = job; std::vector<double> times; double sum = 0; size_t bytes = 0;
        if (name.rfind("read_", 0) == 0) {  // read_KILOBYTES
            set.assign(size_t(atol(job + 5)) * 256 / 256 * 256, 1.f); bytes = 4 * set.size();
            times = seconds(threads, samples, [&](int part, int parts) { size_t own = set.size() / parts; sink = read_sum(&set[part * own], own); });
        } else {
            // 1.5 GB that most measurements do not want.
            if (name.rfind("large_", 0) == 0 && large_face.c.empty()) large_face.make();
            Result& result = jobs.at(name);
            times = seconds(threads, samples, result.work);
            if (result.numbers) for (float x : *result.numbers) sum += x;
            if (result.eigen) for (float x : *result.eigen) sum += x;
        }
        printf("%zu %.9g", bytes, sum);
        for (double s : times) printf(" %.9g", s);
        printf("\n"); fflush(stdout);
    }
}
