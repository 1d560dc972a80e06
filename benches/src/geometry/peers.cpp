// Spatial search by others, as far as their headers are installed: nanoflann, CGAL, and a loop over everything.
// Arguments: the folder of the data. Then a line "job threads samples" at a time; the answer is one of "bytes sum seconds...".
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <vector>
#if __has_include(<nanoflann.hpp>)
#define HAS_NANOFLANN
#include <nanoflann.hpp>
#endif
#if __has_include(<CGAL/AABB_tree.h>)
#define HAS_CGAL
#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/version.h>
#endif

// Queries of a loop over everything.
static const size_t SLOW = 50;

struct Vec { double x, y, z; };
static Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
static double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

template <class T> static std::vector<T> content(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    std::vector<T> values(file ? size_t(file.tellg()) / sizeof(T) : 0);
    file.seekg(0);
    file.read(reinterpret_cast<char*>(values.data()), std::streamsize(values.size() * sizeof(T)));
    return values;
}

// What a job has found, and the bytes of its result where they are known.
struct Found { double sum, bytes; };

struct Data {
    std::vector<Vec> vertices, near, far;
    std::vector<uint32_t> faces;
    const std::vector<Vec>& queries(const std::string& name) const { return name == "near" ? near : far; }
};

// Squared distance of a segment that starts at the origin.
static double segment(Vec p, Vec side) {
    double length = dot(side, side), t = length > 0 ? dot(p, side) / length : 0;
    Vec rest = p - std::fmin(1, std::fmax(0, t)) * side;
    return dot(rest, rest);
}

// Squared distance of a triangle: of its plane where the foot is inside, else of the nearest side.
static double triangle(Vec p, Vec a, Vec b, Vec c) {
    Vec u = b - a, v = c - a, w = p - a;
    double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v), det = uu * vv - uv * uv;
    double s = vv * wu - uv * wv, t = uu * wv - uv * wu;
    if (det > 0 && s >= 0 && t >= 0 && s + t <= det) {
        Vec rest = w - ((s / det) * u + (t / det) * v);
        return dot(rest, rest);
    }
    return std::fmin(std::fmin(segment(w, u), segment(w, v)), segment(p - b, c - b));
}

using Jobs = std::map<std::string, std::function<Found()>>;

static void loops(const Data& data, Jobs& jobs, std::string& programs) {
    if (data.faces.empty()) {
        programs += ";plain C++ loop:every.point.near";
        jobs["every.point.near"] = [&data] {
            double sum = 0;
            for (size_t k = 0; k < SLOW; k++) {
                double least = INFINITY;
                for (Vec point : data.vertices) { Vec d = point - data.near[k]; least = std::fmin(least, dot(d, d)); }
                sum += std::sqrt(least);
            }
            return Found{sum, 0};
        };
        return;
    }
    programs += ";plain C++ loop:every.triangle.near";
    jobs["every.triangle.near"] = [&data] {
        double sum = 0;
        for (size_t k = 0; k < SLOW; k++) {
            double least = INFINITY;
            for (size_t f = 0; f < data.faces.size(); f += 3) {
                const uint32_t* v = &data.faces[f];
                least = std::fmin(least, triangle(data.near[k], data.vertices[v[0]], data.vertices[v[1]], data.vertices[v[2]]));
            }
            sum += std::sqrt(least);
        }
        return Found{sum, 0};
    };
}

#ifdef HAS_NANOFLANN
struct Cloud {
    const std::vector<Vec>& points;
    size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(size_t point, size_t axis) const { return (&points[point].x)[axis]; }
    template <class Box> bool kdtree_get_bbox(Box&) const { return false; }
};
using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, uint32_t>;

static void nanoflann_jobs(const Data& data, Jobs& jobs, std::string& programs) {
    if (!data.faces.empty()) return;
    static Cloud cloud{data.vertices};
    static KdTree tree(3, cloud, {10});
    tree.buildIndex();
    programs += ";nanoflann:points.build,points.near,points.far";
    jobs["points.build"] = [] {
        KdTree again(3, cloud, {10});
        again.buildIndex();
        return Found{0, double(again.usedMemory(again))};
    };
    for (std::string name : {"near", "far"})
        jobs["points." + name] = [&data, name] {
            double sum = 0;
            for (const Vec& p : data.queries(name)) {
                uint32_t nearest; double squared;
                tree.knnSearch(&p.x, 1, &nearest, &squared);
                sum += std::sqrt(squared);
            }
            return Found{sum, 0};
        };
}
#endif

#ifdef HAS_CGAL
using Kernel = CGAL::Simple_cartesian<double>;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Boxes = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<Surface>>>;

static void cgal_jobs(const Data& data, Jobs& jobs, std::string& programs) {
    if (data.faces.empty()) return;
    static Surface surface;
    for (Vec v : data.vertices) surface.add_vertex({v.x, v.y, v.z});
    using Index = Surface::Vertex_index;
    for (size_t f = 0; f < data.faces.size(); f += 3)
        surface.add_face(Index(data.faces[f]), Index(data.faces[f + 1]), Index(data.faces[f + 2]));
    static Boxes tree(faces(surface).first, faces(surface).second, surface);
    tree.accelerate_distance_queries();
    programs += ";CGAL " CGAL_VERSION_STR ":triangles.build,triangles.near,triangles.far";
    jobs["triangles.build"] = [] {
        Boxes again(faces(surface).first, faces(surface).second, surface);
        again.build();
        again.accelerate_distance_queries();
        return Found{double(again.size()), 0};
    };
    for (std::string name : {"near", "far"})
        jobs["triangles." + name] = [&data, name] {
            double sum = 0;
            for (Vec p : data.queries(name)) sum += std::sqrt(tree.squared_distance({p.x, p.y, p.z}));
            return Found{sum, 0};
        };
}
#endif

int main(int, char** arguments) {
    std::string folder = std::string(arguments[1]) + "/";
    static Data data{content<Vec>(folder + "vertices"), content<Vec>(folder + "near"), content<Vec>(folder + "far"),
                     content<uint32_t>(folder + "faces")};
    Jobs jobs;
    std::string programs;
    loops(data, jobs, programs);
#ifdef HAS_NANOFLANN
    nanoflann_jobs(data, jobs, programs);
#endif
#ifdef HAS_CGAL
    cgal_jobs(data, jobs, programs);
#endif
    std::cout << "ready" << programs << std::endl;
    std::string job;
    int threads, samples;
    while (std::cin >> job >> threads >> samples) {
        Found found{0, 0};
        std::vector<double> seconds;
        for (int k = 0; k < samples; k++) {
            auto start = std::chrono::steady_clock::now();
            found = jobs.at(job)();
            seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        }
        printf("%.17g %.17g", found.bytes, found.sum);
        for (double s : seconds) printf(" %.9g", s);
        printf("\n");
        fflush(stdout);
    }
}
