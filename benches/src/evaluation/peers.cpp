// The other side of the rows of evaluation: loops over our own layout left to the compiler, the same jobs by Eigen and by loops over vertices,
// lifting in place, and what the memory can do. Answers as peer.cpp does: "job threads samples" on one thread.
// Usage: peers FILE, whose arrays `evaluation.rs` has written in the order in which they are read here.
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <string>
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
        for (int i = 0; i < n; i++) {
            float m[12] = {};
            for (int k = 0; k < 4; k++) for (int e = 0; e < 12; e++) m[e] += weight[4 * i + k] * motions[12 * held[4 * i + k] + e];
            for (int a = 0; a < 3; a++) out[3 * i + a] = m[4 * a] * v[3 * i] + m[4 * a + 1] * v[3 * i + 1] + m[4 * a + 2] * v[3 * i + 2] + m[4 * a + 3];
        }
    }
    void eigen(int d) {
        pose(d); VectorXf v = Map<VectorXf>(mean.data(), 3 * n);
        if (d) v.noalias() += matrix[d] * Map<VectorXf>(z.data(), d);
        skin_vertices(v.data());
    }
    // Block after block over the layout of the file.
    void plain(int d) {
        pose(d); const float* c = d ? blocked[d].data() : rest.data();
        for (int b = 0; b < blocks; b++) {
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

// Cubic synthesis in place on (height, width, 3), finest lattice last; ends as in our transform.
struct Lifting {
    std::vector<float> source, a; int w = 0, h = 0, levels = 0;
    void read(int l) { source = array<float>(); levels = l; w = (4 << l) + 1; h = (6 << l) + 1; }
    static void line(float* p, int count, size_t stride, int lanes, size_t lane_stride) {
        auto at = [&](int i) { return p + i * stride; };
        for (int i = 2; i + 2 < count; i += 2) for (int l = 0; l < lanes; l++) for (int c = 0; c < 3; c++) {
            size_t o = l * lane_stride + c; at(i)[o] = (at(i)[o] - 0.375f * (at(i - 1)[o] + at(i + 1)[o])) * 0.5f; }
        for (int i = 1; i < count; i += 2) for (int l = 0; l < lanes; l++) for (int c = 0; c < 3; c++) {
            size_t o = l * lane_stride + c; float f = i == 1 ? 0.5f : 1.f, g = i + 2 == count ? 0.5f : 1.f;
            at(i)[o] += f * at(i - 1)[o] + g * at(i + 1)[o]; }
        for (int i = 2; i + 2 < count; i += 2) for (int l = 0; l < lanes; l++) for (int c = 0; c < 3; c++) {
            size_t o = l * lane_stride + c; at(i)[o] += 0.25f * (at(i - 1)[o] + at(i + 1)[o]); }
    }
    void run() {
        a = source;
        for (int s = 1 << (levels - 1); s >= 1; s /= 2) {
            line(a.data(), (h - 1) / s + 1, size_t(s) * w * 3, (w - 1) / s + 1, size_t(3) * s);
            for (int y = 0; y < h; y += s) line(&a[size_t(y) * w * 3], (w - 1) / s + 1, size_t(s) * 3, 1, 0);
        }
    }
};

static float read_sum(const std::vector<float>& v) {
    float a[128] = {};
    for (size_t i = 0; i + 128 <= v.size(); i += 128) for (int l = 0; l < 128; l++) a[l] += v[i + l];
    float s = 0; for (float x : a) s += x;
    return s;
}

int main(int, char** argv) {
    file.open(argv[1], std::ios::binary);
    Body body; body.read();
    Lifting small, large; small.read(5); large.read(6);
    auto points = array<float>();
    Map<Matrix3Xf> X(points.data(), 3, points.size() / 3);
    Matrix3Xf Y = ((1.1f * AngleAxisf(0.3f, Vector3f(1, 2, 3).normalized()).toRotationMatrix()) * X).colwise() + Vector3f(1, 2, 3);
    for (int i = 0; i < body.n; i++) for (int a = 0; a < 3; a++) body.rest[size_t(i / 16) * 48 + 16 * a + i % 16] = body.mean[3 * i + a];
    std::map<std::string, std::function<void()>> jobs = {
        {"skin_vertices", [&] { body.eigen(0); }}, {"skin_blocks", [&] { body.plain(0); }},
        {"body20_eigen", [&] { body.eigen(20); }}, {"body20_blocks", [&] { body.plain(20); }},
        {"body100_eigen", [&] { body.eigen(100); }}, {"body100_blocks", [&] { body.plain(100); }},
        {"wavelet5", [&] { small.run(); }}, {"wavelet6", [&] { large.run(); }},
        {"rigid", [&] { sink = umeyama(X, Y, true)(0, 0); }},
    };
    printf("ready Eigen %d.%d.%d\n", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION); fflush(stdout);
    char job[32]; int threads, samples; std::vector<float> set;
    while (scanf("%31s %d %d", job, &threads, &samples) == 3) {
        std::string name = job; std::vector<double> seconds; double sum = 0; size_t bytes = 0;
        if (name.rfind("read_", 0) == 0) {  // read_KILOBYTES
            set.assign(size_t(atol(job + 5)) * 256 / 128 * 128, 1.f); bytes = 4 * set.size();
            for (int s = 0; s < samples; s++) { double t = now(); sink = read_sum(set); seconds.push_back(now() - t); }
        } else {
            auto& run = jobs.at(name);
            for (int s = 0; s < samples; s++) { double t = now(); run(); seconds.push_back(now() - t); }
            const std::vector<float>& result = name == "wavelet5" ? small.a : name == "wavelet6" ? large.a : body.out;
            for (float x : result) sum += x;
        }
        printf("%zu %.9g", bytes, sum);
        for (double s : seconds) printf(" %.9g", s);
        printf("\n"); fflush(stdout);
    }
}
