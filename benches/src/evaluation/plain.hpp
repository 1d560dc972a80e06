// Loops over our own layout as a good C++ programmer writes them, left to the compiler: blocks of sixteen vertices, terms one behind the other,
// levels of a wavelet in rows of their own. `part` of `parts` is what one thread does.
#pragma once
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>
#ifdef __F16C__
#include <immintrin.h>
#endif

// As workload.rs has it.
static float noise(uint32_t k) {
    k = (k ^ 0x9e37u) * 0x85ebca6bu; k = (k ^ (k >> 13)) * 0xc2b2ae35u; return float(k >> 8) / 8388608.0f - 1.0f;
}
// The first block of a part.
static int first(int blocks, int part, int parts) { return blocks * part / parts; }
// Sixteen vertices of one block, xyz after xyz.
static void store(float* out, int n, int b, const float* v) {
    for (int l = 0; l < 16 && 16 * b + l < n; l++) for (int a = 0; a < 3; a++) out[3 * (16 * b + l) + a] = v[16 * a + l];
}

// Sixteen times three numbers of 16 bits; GCC 12 converts them one by one when left alone.
static void widen(const _Float16* from, float* to) {
#ifdef __F16C__
    for (int l = 0; l < 48; l += 8) _mm256_storeu_ps(to + l, _mm256_cvtph_ps(_mm_loadu_si128((const __m128i*)(from + l))));
#else
    for (int l = 0; l < 48; l++) to[l] = float(from[l]);
#endif
}

// Terms in 16 bits, and in bytes with a scale and an offset for each axis; the first term of a block stays as it is.
struct Halves {
    int terms = 0; std::vector<float> offset; std::vector<_Float16> c;
    void make(const std::vector<float>& from, int blocks, int with_offset) {
        terms = with_offset - 1; offset.resize(size_t(blocks) * 48); c.resize(size_t(blocks) * terms * 48);
        for (size_t b = 0; b < size_t(blocks); b++) {
            const float* p = &from[b * with_offset * 48];
            std::memcpy(&offset[48 * b], p, 192);
            for (size_t k = 0; k < size_t(terms) * 48; k++) c[b * terms * 48 + k] = _Float16(p[48 + k]);
        }
    }
    void sum(int b, const float* weights, float* v) const {
        const _Float16* p = &c[size_t(b) * terms * 48];
        for (int l = 0; l < 48; l++) v[l] = offset[48 * b + l];
        for (int t = 0; t < terms; t++, p += 48) { float wide[48]; widen(p, wide); for (int l = 0; l < 48; l++) v[l] += weights[t] * wide[l]; }
    }
};
struct Bytes {
    int terms = 0; std::vector<float> offset, range; std::vector<int8_t> c;
    // n: vertices; lanes behind the last have no part in the range.
    void make(const std::vector<float>& from, int n, int with_offset) {
        size_t blocks = (n + 15) / 16;
        terms = with_offset - 1; offset.resize(blocks * 48); c.resize(blocks * terms * 48); range.resize(blocks * terms * 6);
        for (size_t b = 0; b < blocks; b++) {
            const float* p = &from[b * with_offset * 48]; int used = std::min(16, n - int(16 * b));
            std::memcpy(&offset[48 * b], p, 192); p += 48;
            for (size_t t = b * terms; t < (b + 1) * terms; t++) for (int a = 0; a < 3; a++, p += 16) {
                float least = p[0], largest = p[0];
                for (int l = 1; l < used; l++) { least = std::min(least, p[l]); largest = std::max(largest, p[l]); }
                float scale = (largest - least) / 255.f, zero = least + 128.f * scale;
                range[6 * t + 2 * a] = scale; range[6 * t + 2 * a + 1] = zero;
                for (int l = 0; l < 16; l++) {
                    float steps = scale > 0 ? ((l < used ? p[l] : 0.f) - zero) / scale : 0.f;
                    c[48 * t + 16 * a + l] = int8_t(std::max(-128.f, std::min(127.f, std::round(steps))));
                }
            }
        }
    }
    void sum(int b, const float* weights, float* v) const {
        const int8_t* p = &c[size_t(b) * terms * 48]; const float* r = &range[size_t(b) * terms * 6];
        float zero[3] = {};
        for (int l = 0; l < 48; l++) v[l] = offset[48 * b + l];
        for (int t = 0; t < terms; t++, p += 48, r += 6) for (int a = 0; a < 3; a++) {
            float scale = weights[t] * r[2 * a]; zero[a] += weights[t] * r[2 * a + 1];
            for (int l = 0; l < 16; l++) v[16 * a + l] += scale * float(p[16 * a + l]);
        }
        for (int l = 0; l < 48; l++) v[l] += zero[l / 16];
    }
};

// A bilinear model of n vertices.
template <int N, int DI, int DP> struct Faces {
    static const int n = N, di = DI, dp = DP, terms = 1 + di * dp, blocks = (n + 15) / 16, dim = di + dp;
    std::vector<float> c, columns, out, values, jacobian, products, sums; Halves half; Bytes bytes;
    Eigen::VectorXf x, y; Eigen::MatrixXf jtj; Eigen::VectorXf jtr;
    void make() {
        c.assign(size_t(blocks) * terms * 48, 0.f); columns.assign(size_t(blocks) * (1 + dp) * 48, 0.f); out.resize(3 * n); x.resize(di); y.resize(dp);
        for (int i = 0; i < di; i++) x[i] = noise(1000000 + i);
        for (int j = 0; j < dp; j++) y[j] = noise(2000000 + j);
        for (size_t at = 0; at < c.size(); at++) {
            size_t b = at / (terms * 48), k = at % (terms * 48);
            if (b * 16 + k % 16 < size_t(n)) c[at] = (k < 48 ? 100.f : 1.f) * noise(at);
        }
        for (int b = 0; b < blocks; b++) for (int k = 0; k < 48; k++) {
            const float* from = &c[size_t(b) * terms * 48 + k]; float* to = &columns[size_t(b) * (1 + dp) * 48 + k];
            to[0] = from[0];
            for (int j = 0; j < dp; j++) for (int i = 0; i < di; i++) to[48 * (1 + j)] += x[i] * from[48 * (1 + i * dp + j)];
        }
        half.make(c, blocks, terms); bytes.make(c, n, terms);
        for (int i = 0; i < di; i++) for (int j = 0; j < dp; j++) products.push_back(x[i] * y[j]);
    }
    void full(int part, int parts) {
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++) {
            const float* p = &c[size_t(b) * terms * 48]; float v[48];
            for (int l = 0; l < 48; l++) v[l] = p[l];
            for (int i = 0; i < di; i++) {
                float t[48] = {};
                for (int j = 0; j < dp; j++) { p += 48; for (int l = 0; l < 48; l++) t[l] += y[j] * p[l]; }
                for (int l = 0; l < 48; l++) v[l] += x[i] * t[l];
            }
            store(&out[0], n, b, v);
        }
    }
    template <class Terms> void stored(const Terms& terms, int part, int parts) {
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++) {
            float v[48]; terms.sum(b, products.data(), v); store(&out[0], n, b, v);
        }
    }
    void fixed(int part, int parts) {
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++) {
            const float* p = &columns[size_t(b) * (1 + dp) * 48]; float v[48];
            for (int l = 0; l < 48; l++) v[l] = p[l];
            for (int j = 0; j < dp; j++) { p += 48; for (int l = 0; l < 48; l++) v[l] += y[j] * p[l]; }
            store(&out[0], n, b, v);
        }
    }
    void block_derivatives(int b, float* v, float* by_x) const {
        const float* p = &c[size_t(b) * terms * 48]; float* by_y = by_x + di * 48;
        for (int l = 0; l < 48; l++) v[l] = p[l];
        for (int l = 0; l < dp * 48; l++) by_y[l] = 0;
        for (int i = 0; i < di; i++) {
            float t[48] = {};
            for (int j = 0; j < dp; j++) { p += 48; for (int l = 0; l < 48; l++) { t[l] += y[j] * p[l]; by_y[48 * j + l] += x[i] * p[l]; } }
            for (int l = 0; l < 48; l++) { v[l] += x[i] * t[l]; by_x[48 * i + l] = t[l]; }
        }
    }
    void derivatives(int part, int parts) {
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++)
            block_derivatives(b, &values[48 * b], &jacobian[size_t(b) * dim * 48]);
    }
    // Vertices against targets: the derivatives of a block, then one row after another into the normal matrix.
    float equations(const std::vector<float>& target) {
        float m[dim][(dim + 7) / 8 * 8] = {}, rhs[(dim + 7) / 8 * 8] = {}, cost = 0, v[48], slopes[dim * 48];
        for (int b = 0; b < blocks; b++) {
            block_derivatives(b, v, slopes);
            for (int l = 0; l < 16 && 16 * b + l < n; l++) for (int a = 0; a < 3; a++) {
                float row[(dim + 7) / 8 * 8] = {}, r = v[16 * a + l] - target[3 * (16 * b + l) + a];
                for (int p = 0; p < dim; p++) row[p] = slopes[48 * p + 16 * a + l];
                for (int p = 0; p < dim; p++) { float s = row[p]; for (int q = 0; q < (dim + 7) / 8 * 8; q++) m[p][q] += s * row[q]; }
                for (int q = 0; q < (dim + 7) / 8 * 8; q++) rhs[q] += r * row[q];
                cost += r * r;
            }
        }
        jtj.resize(dim, dim); jtr.resize(dim); sums.clear();
        for (int p = 0; p < dim; p++) { jtr[p] = rhs[p]; for (int q = 0; q < dim; q++) { jtj(p, q) = m[p][q]; sums.push_back(m[p][q]); } }
        sums.insert(sums.end(), rhs, rhs + dim);
        return cost;
    }
    // Levenberg-Marquardt over these equations from a start far away.
    void fit() {
        const Eigen::VectorXf true_x = x, true_y = y; full(0, 1);
        const std::vector<float> target = out; float damping = 1e-3f;
        x.setConstant(0.2f); y.setConstant(0.2f);
        float cost = equations(target);
        for (int step = 0; step < 50; step++) {
            Eigen::MatrixXf a = jtj; a.diagonal() *= 1 + damping;
            Eigen::VectorXf d = a.ldlt().solve(-jtr), old_x = x, old_y = y, old_r = jtr; Eigen::MatrixXf old_m = jtj;
            x += d.head(di); y += d.tail(dp);
            float trial = equations(target);
            if (trial < cost) { damping *= 0.1f; bool done = cost - trial < 1e-6f * cost || trial < 1e-3f; cost = trial; if (done) break; }
            else { x = old_x; y = old_y; jtj = old_m; jtr = old_r; damping *= 10; if (damping > 1e6f) break; }
        }
        full(0, 1); x = true_x; y = true_y;
    }
};

// A posed skeleton with balls: motions, the axes about which points turn, and how places follow the identity.
struct Skeleton {
    typedef Eigen::Matrix<float, 3, 4> Motion; typedef Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> Rows;
    std::vector<int> parent; std::vector<Motion> motion; std::vector<Eigen::Matrix3f> axes; std::vector<Eigen::Vector3f> at;
    std::vector<Eigen::Matrix3Xf> shift; std::vector<float> dual;
    void pose(const std::vector<int>& parents, const float* angles, const float* place, const Rows* slopes, const float* z, bool derivatives) {
        int J = parents.size(), d = slopes ? slopes->cols() : 0;
        parent = parents; motion.resize(J); axes.resize(J); at.resize(J); shift.resize(J);
        Eigen::VectorXf p = Eigen::Map<const Eigen::VectorXf>(place, 3 * J);
        if (d) p += *slopes * Eigen::Map<const Eigen::VectorXf>(z, d);
        for (int j = 0; j < J; j++) {
            Eigen::Vector3f turn(angles[3 * j], angles[3 * j + 1], angles[3 * j + 2]), here = p.segment<3>(3 * j); float angle = turn.norm();
            Eigen::Matrix3f own = angle > 0 ? Eigen::AngleAxisf(angle, turn / angle).toRotationMatrix() : Eigen::Matrix3f(Eigen::Matrix3f::Identity());
            Motion up; up.setIdentity(); if (parent[j] >= 0) up = motion[parent[j]];
            Eigen::Matrix3f before = up.leftCols<3>(), turned = before * own;
            at[j] = before * here + up.col(3);
            motion[j].leftCols<3>() = turned; motion[j].col(3) = at[j] - turned * here;
            if (!derivatives) continue;
            Eigen::Matrix3f k; k << 0, -turn[2], turn[1], turn[2], 0, -turn[0], -turn[1], turn[0], 0;
            float a = angle > 1e-4f ? (1 - std::cos(angle)) / (angle * angle) : 0.5f, b = angle > 1e-4f ? (angle - std::sin(angle)) / (angle * angle * angle) : 1 / 6.f;
            axes[j] = before * (Eigen::Matrix3f::Identity() + a * k + b * k * k);
            if (d) {
                shift[j] = (before - turned) * slopes->middleRows<3>(3 * j);
                if (parent[j] >= 0) shift[j] += shift[parent[j]];
            }
        }
    }
    void duals() {
        dual.resize(8 * motion.size());
        for (size_t j = 0; j < motion.size(); j++) {
            Eigen::Quaternionf q(Eigen::Matrix3f(motion[j].leftCols<3>())); Eigen::Vector3f t = motion[j].col(3);
            Eigen::Quaternionf e = Eigen::Quaternionf(0, t[0] / 2, t[1] / 2, t[2] / 2) * q;
            float all[8] = {q.w(), q.x(), q.y(), q.z(), e.w(), e.x(), e.y(), e.z()};
            std::memcpy(&dual[8 * j], all, sizeof all);
        }
    }
};

// Blocks held by joints: entries `starts[b]..starts[b + 1]`, sixteen weights each.
struct Skin {
    std::vector<int> starts, joints; std::vector<float> weights;
    // Sums of motions, row after row: [12][16].
    void blend(int b, const Skeleton& s, float m[12][16]) const {
        std::memset(m, 0, 12 * 64);
        for (int e = starts[b]; e < starts[b + 1]; e++) {
            const auto& of = s.motion[joints[e]]; const float* w = &weights[16 * e];
            for (int r = 0; r < 3; r++) for (int c = 0; c < 4; c++) { float f = of(r, c); for (int l = 0; l < 16; l++) m[4 * r + c][l] += w[l] * f; }
        }
    }
    void move(int b, const Skeleton& s, const float* v, float* x) const {
        std::memset(x, 0, 192);
        for (int e = starts[b]; e < starts[b + 1]; e++) {
            const auto& m = s.motion[joints[e]]; const float* w = &weights[16 * e];
            for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) x[16 * a + l] += w[l] * (m(a, 0) * v[l] + m(a, 1) * v[16 + l] + m(a, 2) * v[32 + l] + m(a, 3));
        }
    }
    // On the side of the strongest joint's quaternion.
    void move_dual(int b, const Skeleton& s, const float* v, float* out) const {
        float strongest[16], pivot[4][16] = {}, q[8][16] = {};
        for (float& w : strongest) w = -1;
        for (int e = starts[b]; e < starts[b + 1]; e++) {
            const float *of = &s.dual[8 * joints[e]], *w = &weights[16 * e];
            for (int l = 0; l < 16; l++) { bool more = w[l] > strongest[l]; for (int k = 0; k < 4; k++) pivot[k][l] = more ? of[k] : pivot[k][l]; strongest[l] = more ? w[l] : strongest[l]; }
        }
        for (int e = starts[b]; e < starts[b + 1]; e++) {
            const float *of = &s.dual[8 * joints[e]], *w = &weights[16 * e]; float side[16];
            for (int l = 0; l < 16; l++) side[l] = of[0] * pivot[0][l] + of[1] * pivot[1][l] + of[2] * pivot[2][l] + of[3] * pivot[3][l] < 0 ? -w[l] : w[l];
            for (int k = 0; k < 8; k++) for (int l = 0; l < 16; l++) q[k][l] += side[l] * of[k];
        }
        for (int l = 0; l < 16; l++) {
            float w = q[0][l], x = q[1][l], y = q[2][l], z = q[3][l], d = q[4][l], a = q[5][l], b = q[6][l], c = q[7][l];
            float px = v[l], py = v[16 + l], pz = v[32 + l], norm = w * w + x * x + y * y + z * z, inverse = norm > 0 ? 1 / norm : 0;
            float cx = y * pz - z * py + w * px, cy = z * px - x * pz + w * py, cz = x * py - y * px + w * pz;
            float along = x * px + y * py + z * pz;  // r v r*: (w, u)(0, v)(w, -u)
            float rx = w * cx + along * x - (cy * z - cz * y), ry = w * cy + along * y - (cz * x - cx * z), rz = w * cz + along * z - (cx * y - cy * x);
            float tx = 2 * (w * a - d * x + y * c - z * b), ty = 2 * (w * b - d * y + z * a - x * c), tz = 2 * (w * c - d * z + x * b - y * a);
            out[l] = (rx + tx) * inverse; out[16 + l] = (ry + ty) * inverse; out[32 + l] = (rz + tz) * inverse;
        }
    }
};

// A body of d components; c: [block][1 + d][48].
struct Bodies {
    static const int batch = 64;
    const float *c = nullptr, *z = nullptr, *angles = nullptr, *place = nullptr; int d = 0, n = 0, blocks = 0;
    Skeleton::Rows slopes; std::vector<int> parents; const Skin* skin = nullptr;
    Skeleton skeleton; std::vector<Skeleton> many; Halves half; Bytes bytes;
    std::vector<float> out, batched, values, jacobian, gradient, forces;
    void pose(Skeleton& to, bool derivatives) { to.pose(parents, angles, place, d ? &slopes : nullptr, z, derivatives); }
    void shape(int b, float* v) const {
        const float* p = c + size_t(b) * (1 + d) * 48;
        for (int l = 0; l < 48; l++) v[l] = p[l];
        for (int k = 0; k < d; k++) { p += 48; for (int l = 0; l < 48; l++) v[l] += z[k] * p[l]; }
    }
    void positions(int part, int parts) {
        if (part == 0) pose(skeleton, false);
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++) { float v[48], x[48]; shape(b, v); skin->move(b, skeleton, v, x); store(&out[0], n, b, x); }
    }
    void dual(int part, int parts) {
        if (part == 0) { pose(skeleton, false); skeleton.duals(); }
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++) { float v[48], x[48]; shape(b, v); skin->move_dual(b, skeleton, v, x); store(&out[0], n, b, x); }
    }
    template <class Terms> void stored(const Terms& terms, int part, int parts) {
        if (part == 0) pose(skeleton, false);
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++) { float v[48], x[48]; terms.sum(b, z, v); skin->move(b, skeleton, v, x); store(&out[0], n, b, x); }
    }
    // Every block once for all of them.
    void together(int part, int parts) {
        many.resize(batch);
        for (int k = first(batch, part, parts); k < first(batch, part + 1, parts); k++) pose(many[k], false);
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++)
            for (int k = 0; k < batch; k++) { float v[48], x[48]; shape(b, v); skin->move(b, many[k], v, x); store(&batched[size_t(k) * 3 * n], n, b, x); }
    }
    void derivatives(int part, int parts) {
        if (part == 0) pose(skeleton, true);
        int dim = d + 3 * parents.size();
        for (int b = first(blocks, part, parts); b < first(blocks, part + 1, parts); b++) {
            float v[48], m[12][16], *x = &values[48 * b], *to = &jacobian[size_t(b) * dim * 48]; const float* p = c + size_t(b) * (1 + d) * 48;
            shape(b, v); skin->blend(b, skeleton, m);
            for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) x[16 * a + l] = m[4 * a][l] * v[l] + m[4 * a + 1][l] * v[16 + l] + m[4 * a + 2][l] * v[32 + l] + m[4 * a + 3][l];
            for (int k = 0; k < d; k++, to += 48) {
                p += 48;
                for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) to[16 * a + l] = m[4 * a][l] * p[l] + m[4 * a + 1][l] * p[16 + l] + m[4 * a + 2][l] * p[32 + l];
                for (int e = skin->starts[b]; e < skin->starts[b + 1]; e++) {
                    const float *s = skeleton.shift[skin->joints[e]].data() + 3 * k, *w = &skin->weights[16 * e];
                    for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) to[16 * a + l] += w[l] * s[a];
                }
            }
            std::memset(to, 0, 192 * (dim - d));
            for (int e = skin->starts[b]; e < skin->starts[b + 1]; e++) {
                const float* w = &skin->weights[16 * e]; const auto& of = skeleton.motion[skin->joints[e]]; float u[48];
                for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) u[16 * a + l] = w[l] * (of(a, 0) * v[l] + of(a, 1) * v[16 + l] + of(a, 2) * v[32 + l] + of(a, 3));
                for (int j = skin->joints[e]; j >= 0; j = parents[j]) {
                    float arm[48];
                    for (int a = 0; a < 3; a++) { float o = skeleton.at[j][a]; for (int l = 0; l < 16; l++) arm[16 * a + l] = u[16 * a + l] - w[l] * o; }
                    for (int k = 0; k < 3; k++) {
                        float *y = to + 48 * (3 * j + k), ax = skeleton.axes[j](0, k), ay = skeleton.axes[j](1, k), az = skeleton.axes[j](2, k);
                        for (int l = 0; l < 16; l++) { y[l] += ay * arm[32 + l] - az * arm[16 + l]; y[16 + l] += az * arm[l] - ax * arm[32 + l]; y[32 + l] += ax * arm[16 + l] - ay * arm[l]; }
                    }
                }
            }
        }
    }
    // Of forces on the vertices: forces and torques on joints, carried to the root, and the components against the forces turned back.
    void reverse() {
        pose(skeleton, true);
        int J = parents.size(); std::vector<Eigen::Vector3f> force(J, Eigen::Vector3f::Zero()), torque = force; std::vector<float> by(48 * d, 0.f);
        for (int b = 0; b < blocks; b++) {
            float v[48], g[48] = {}, back[48] = {}; shape(b, v);
            for (int l = 0; l < 16 && 16 * b + l < n; l++) for (int a = 0; a < 3; a++) g[16 * a + l] = forces[3 * (16 * b + l) + a];
            for (int e = skin->starts[b]; e < skin->starts[b + 1]; e++) {
                int j = skin->joints[e]; const float* w = &skin->weights[16 * e]; const auto& m = skeleton.motion[j]; float u[48], f[48], t[48];
                for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) { u[16 * a + l] = m(a, 0) * v[l] + m(a, 1) * v[16 + l] + m(a, 2) * v[32 + l] + m(a, 3); f[16 * a + l] = w[l] * g[16 * a + l]; }
                for (int l = 0; l < 16; l++) { t[l] = u[16 + l] * f[32 + l] - u[32 + l] * f[16 + l]; t[16 + l] = u[32 + l] * f[l] - u[l] * f[32 + l]; t[32 + l] = u[l] * f[16 + l] - u[16 + l] * f[l]; }
                for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) back[16 * a + l] += m(0, a) * f[l] + m(1, a) * f[16 + l] + m(2, a) * f[32 + l];
                for (int a = 0; a < 3; a++) for (int l = 0; l < 16; l++) { force[j][a] += f[16 * a + l]; torque[j][a] += t[16 * a + l]; }
            }
            const float* p = c + size_t(b) * (1 + d) * 48;
            for (int k = 0; k < d; k++) { p += 48; for (int l = 0; l < 48; l++) by[48 * k + l] += p[l] * back[l]; }
        }
        for (int k = 0; k < d; k++) {
            gradient[k] = 0; for (int l = 0; l < 48; l++) gradient[k] += by[48 * k + l];
            for (int j = 0; j < J; j++) gradient[k] += force[j].dot(skeleton.shift[j].col(k));
        }
        for (int j = J - 1; j >= 0; j--) {
            Eigen::Vector3f all = torque[j] - skeleton.at[j].cross(force[j]);
            for (int k = 0; k < 3; k++) gradient[d + 3 * j + k] = skeleton.axes[j].col(k).dot(all);
            if (parents[j] >= 0) { force[parents[j]] += force[j]; torque[parents[j]] += torque[j]; }
        }
    }
};

// Cubic synthesis of planes of coefficients, level by level, each level's details by rows; one component is the work of one thread.
struct Levels {
    int levels = 0, w = 0, h = 0; std::vector<float> coefficients, out, first, second;
    void size(int l) { levels = l; w = (4 << l) + 1; h = (6 << l) + 1; out.resize(3 * w * h); first.resize(3 * w * h); second.resize(3 * w * h); }
    static void lift_rows(float* a, int w, int h) {
        auto row = [&](int y) { return a + size_t(y) * w; };
        for (int y = 2; y + 2 < h; y += 2) { float *r = row(y), *p = row(y - 1), *q = row(y + 1); for (int i = 0; i < w; i++) r[i] = 0.5f * (r[i] - 0.375f * (p[i] + q[i])); }
        for (int y = 1; y < h; y += 2) {
            float *r = row(y), *p = row(y - 1), *q = row(y + 1), f = y == 1 ? 0.5f : 1.f, g = y == h - 2 ? 0.5f : 1.f;
            for (int i = 0; i < w; i++) r[i] += f * p[i] + g * q[i];
        }
        for (int y = 2; y + 2 < h; y += 2) { float *r = row(y), *p = row(y - 1), *q = row(y + 1); for (int i = 0; i < w; i++) r[i] += 0.25f * (p[i] + q[i]); }
    }
    static void lift_row(float* r, int w) {
        for (int i = 2; i + 2 < w; i += 2) r[i] = 0.5f * (r[i] - 0.375f * (r[i - 1] + r[i + 1]));
        r[1] += 0.5f * r[0] + (w == 3 ? 0.5f : 1.f) * r[2];
        for (int i = 3; i + 2 < w; i += 2) r[i] += r[i - 1] + r[i + 1];
        if (w > 3) r[w - 2] += r[w - 3] + 0.5f * r[w - 1];
        for (int i = 2; i + 2 < w; i += 2) r[i] += 0.25f * (r[i - 1] + r[i + 1]);
    }
    void component(int k) {
        size_t all = size_t(w) * h; const float* p = &coefficients[k * all]; float *coarse = &first[k * all], *fine = &second[k * all];
        std::memcpy(coarse, p, 4 * 35); p += 35;
        for (int l = 1; l <= levels; l++) {
            int wl = (4 << l) + 1, hl = (6 << l) + 1;
            if (l == levels) fine = &out[k * all];
            for (int y = 0; y < hl; y++) {
                float* r = fine + size_t(y) * wl;
                if (y % 2) { std::memcpy(r, p, 4 * wl); p += wl; continue; }
                const float* q = coarse + size_t(y / 2) * (wl / 2 + 1);
                for (int i = 0; i < wl / 2; i++) { r[2 * i] = q[i]; r[2 * i + 1] = p[i]; }
                r[wl - 1] = q[wl / 2]; p += wl / 2;
            }
            lift_rows(fine, wl, hl);
            for (int y = 0; y < hl; y++) lift_row(fine + size_t(y) * wl, wl);
            std::swap(coarse, fine);
        }
    }
    void run(int part, int parts) { for (int k = 3 * part / parts; k < 3 * (part + 1) / parts; k++) component(k); }
};

// A bilinear model for every coefficient, sixteen coefficients in a block, and the synthesis; positions as xyz.
struct Blocks {
    static const int di = 10, dp = 5, terms = 1 + di * dp; Levels levels; int n = 0, blocks = 0; std::vector<float> c, x, y, out;
    void make() {
        levels.size(5); n = levels.w * levels.h; blocks = (n + 15) / 16; c.assign(size_t(blocks) * terms * 48, 0.f); out.resize(3 * n); levels.coefficients.resize(3 * n);
        for (int q = 0; q < n; q++) for (int t = 0; t < terms; t++) for (int a = 0; a < 3; a++) c[(size_t(q / 16) * terms + t) * 48 + 16 * a + q % 16] = noise(7000000 + 3 * n * t + 3 * q + a);
        for (int k = 0; k < n * di; k++) x.push_back(noise(8000000 + k));
        for (int k = 0; k < n * dp; k++) y.push_back(noise(9000000 + k));
    }
    void run(int part, int parts) {
        int from = 3 * part / parts, to = 3 * (part + 1) / parts;
        for (int b = 0; b < blocks; b++) {
            float xs[di][16] = {}, ys[dp][16] = {}; int used = std::min(16, n - 16 * b);
            for (int l = 0; l < used; l++) { for (int i = 0; i < di; i++) xs[i][l] = x[(16 * b + l) * di + i]; for (int j = 0; j < dp; j++) ys[j][l] = y[(16 * b + l) * dp + j]; }
            for (int a = from; a < to; a++) {
                const float* p = &c[size_t(b) * terms * 48 + 16 * a]; float s[16];
                for (int l = 0; l < 16; l++) s[l] = p[l];
                for (int i = 0; i < di; i++) {
                    float t[16] = {};
                    for (int j = 0; j < dp; j++) { p += 48; for (int l = 0; l < 16; l++) t[l] += ys[j][l] * p[l]; }
                    for (int l = 0; l < 16; l++) s[l] += xs[i][l] * t[l];
                }
                for (int l = 0; l < used; l++) levels.coefficients[size_t(a) * n + 16 * b + l] = s[l];
            }
        }
        for (int a = from; a < to; a++) { levels.component(a); for (int v = 0; v < n; v++) out[3 * v + a] = levels.out[size_t(a) * n + v]; }
    }
};

// One pass of moments in sixteen lanes, then the rotation by Eigen.
struct Moments {
    std::vector<float> p, q; int n = 0;
    float run() const {
        float sum[21][16] = {}; const float *p0 = &p[0], *q0 = &q[0];
        for (int b = 0; b < n / 16 * 16; b += 16) {
            float x[6][16];
            for (int l = 0; l < 16; l++) for (int a = 0; a < 3; a++) { x[a][l] = p[3 * (b + l) + a] - p0[a]; x[3 + a][l] = q[3 * (b + l) + a] - q0[a]; }
            for (int a = 0; a < 6; a++) for (int l = 0; l < 16; l++) sum[a][l] += x[a][l];
            for (int a = 0, k = 6; a < 3; a++) for (int c = a; c < 6; c++, k++) for (int l = 0; l < 16; l++) sum[k][l] += x[a][l] * x[c][l];
        }
        float s[21] = {}; for (int k = 0; k < 21; k++) for (int l = 0; l < 16; l++) s[k] += sum[k][l];
        for (int v = n / 16 * 16; v < n; v++) {
            float x[6]; for (int a = 0; a < 3; a++) { x[a] = p[3 * v + a] - p0[a]; x[3 + a] = q[3 * v + a] - q0[a]; }
            for (int a = 0; a < 6; a++) s[a] += x[a];
            for (int a = 0, k = 6; a < 3; a++) for (int c = a; c < 6; c++, k++) s[k] += x[a] * x[c];
        }
        Eigen::Matrix3f cross; int k = 6;
        for (int a = 0; a < 3; a++) for (int c = a; c < 6; c++, k++) if (c >= 3) cross(c - 3, a) = s[k] - s[a] * s[c] / n;
        Eigen::JacobiSVD<Eigen::Matrix3f> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
        return (svd.matrixU() * svd.matrixV().transpose())(0, 0);
    }
};
