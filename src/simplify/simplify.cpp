#include "its/simplify.h"

#include <cmath>
#include <ctime>
#include <cstdlib>

#include "base/parallel.h"
#include "simplify/decimate.h"
#include "simplify/deviation.h"

namespace its {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

class Free : public CollapseRule {
    Verdict test(const Collapse&, const Complex&, double) override { return {true}; }
    void accept() override {}
};

class Certified : public CollapseRule {
public:
    explicit Certified(const Complex& original) : deviation_(original) {}
    Verdict test(const Collapse& c, const Complex& current, double tolerance) override {
        frames_.clear();
        for (const auto& p : c.corners) frames_.push_back(make_frame(p[0], p[1], p[2]));
        const auto v = deviation_.test(c.ring, c.faces(), frames_, current, tolerance);
        return {v.proven, v.proven ? 0 : std::max(v.need, std::nextafter(tolerance, infinity))};
    }
    void accept() override { deviation_.accept(); }

    Deviation deviation_;
    std::vector<Frame> frames_;
};

Mesh extract(const Complex& c) {
    Mesh mesh;
    std::vector<std::uint32_t> number(c.vertices(), no_index);
    for (std::uint32_t t = 0; t < c.triangles(); ++t) {
        if (!c.has_triangle(t)) continue;
        Triangle corners = c.triangle(t);
        for (std::uint32_t& v : corners) {
            if (number[v] == no_index) {
                number[v] = std::uint32_t(mesh.vertices.size());
                mesh.vertices.push_back(c.position(v));
            }
            v = number[v];
        }
        mesh.triangles.push_back(corners);
    }
    return mesh;
}

double env(const char* n, double d) { const char* s = getenv(n); return s ? atof(s) : d; }

}  // namespace

Simplified simplify(const Mesh& mesh, const SimplifyOptions& options) {
    const clock_t watch = clock();
    Complex complex(mesh);
    Simplified result;
    result.report.faces_before = complex.living_triangles();
    const auto none = [](std::uint64_t) {};
    if (options.method == SimplifyMethod::qem) {
        Free rule;
        Decimator d(complex, rule);
        d.run(options.faces.value_or(0), 0, none);
        result.report.tests = d.tests();
    } else {
        Certified rule(complex);
        Decimator d(complex, rule);
        if (options.tolerance) {
            d.run(options.faces.value_or(0), *options.tolerance, none);
            result.report.tolerance = *options.tolerance;
        } else {
            const Box b = inspect(mesh).bounds;
            const double diagonal = std::sqrt(std::pow(b.max.x - b.min.x, 2) + std::pow(b.max.y - b.min.y, 2) + std::pow(b.max.z - b.min.z, 2));
            int levels=0; double tolerance = diagonal * env("T0", 1e-5);
            const double ratio = env("RATIO", 1.25);
            while (!d.run(*options.faces, tolerance, none, env("ALPHA",1e300))) {
                const double next = d.next_tolerance(tolerance);
                if (next == infinity) break;
                tolerance = std::max(tolerance * ratio, next); ++levels;
            }
            result.report.tolerance = tolerance; printf("levels %d ", levels);
        }
        result.report.tests = d.tests();
    }
    result.mesh = extract(complex);
    result.report.faces_after = complex.living_triangles();
    result.report.seconds = double(clock()-watch)/CLOCKS_PER_SEC;
    return result;
}

}  // namespace its
