#include "picture/tracer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "base/parallel.h"

namespace its::picture {
namespace {

constexpr double pi = std::numbers::pi;

// The light, relative to what an unshadowed floor receives in all.
constexpr double key_share = 0.62;               // from the key light
constexpr double key_radius = 0.16;              // of its disc, seen at distance 1: soft edges of shadows
constexpr double horizon = 0.72, zenith = 1.14;  // of the dome; averages to 1 over a floor
constexpr double floor_light = 0.52;             // what the floor sends up
constexpr double near_light = 0.34;              // what bodies near by send, times their colour
constexpr double floor_near_light = 0.12;        // what bodies send down to the floor
constexpr Light paper_light = {1, 1, 1};
constexpr double gloss = 0.16, gloss_power = 48;

constexpr double edge_fade = 0.3;  // of a picture's shorter side

/// A pixel whose first samples all show paper is taken to be empty: most are, and a shadow that all of them
/// miss darkens the pixel by a few of 255 steps at most.
constexpr int samples_to_be_empty = 8;

/// A ray leaves a surface this far off it, so as not to meet it again: above a hundred roundings of single
/// precision for coordinates up to 4.
constexpr double lift = 4e-5;

/// Two unit vectors at right angles to a third.
std::pair<Vec3, Vec3> across(const Vec3& n) {
    const Vec3 helper = std::abs(n.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
    const Vec3 a = cross(helper, n), unit = (1 / norm(a)) * a;
    return {unit, cross(n, unit)};
}

Vec3 unit(const Vec3& v) {
    return (1 / norm(v)) * v;
}

/// A direction around n, distributed as the cosine of the angle to it.
Vec3 cosine_direction(const Vec3& n, double r1, double r2) {
    const auto [a, b] = across(n);
    const double radius = std::sqrt(r1), angle = 2 * pi * r2;
    return unit(radius * std::cos(angle) * a + radius * std::sin(angle) * b +
                std::sqrt(std::max(0.0, 1 - r1)) * n);
}

double sky(const Vec3& direction) {
    return std::lerp(horizon, zenith, std::max(0.0, direction.z));
}

/// From 0 at t ≤ 0 to 1 at t ≥ 1.
double smooth_step(double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

Light times(const Light& a, const Light& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

/// Six numbers in [0, 1) for each sample of a pixel: the additive recurrence of M. Roberts, "The unreasonable
/// effectiveness of quasirandom sequences", displaced by a hash of the pixel.
class Sequence {
public:
    Sequence(int x, int y) {
        std::uint64_t state = (std::uint64_t(std::uint32_t(x)) << 32) | std::uint32_t(y);
        for (double& s : start_) {  // SplitMix64
            std::uint64_t z = state += 0x9e3779b97f4a7c15ull;
            z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
            z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
            s = double((z ^ (z >> 31)) >> 11) * 0x1p-53;
        }
    }
    std::array<double, 6> at(int sample) const {
        constexpr double root = 1.0969815577985598;  // of x⁷ = x + 1
        std::array<double, 6> values;
        double step = 1;
        for (std::size_t i = 0; i < values.size(); ++i) {
            step /= root;
            const double v = start_[i] + step * (sample + 1);
            values[i] = v - std::floor(v);
        }
        return values;
    }

private:
    std::array<double, 6> start_;
};

}  // namespace

Studio::Studio(std::vector<Exhibit> exhibits, const Vec3& key_light, double floor, double reach)
    : exhibits_(std::move(exhibits)), key_light_(key_light), floor_(floor), reach_(reach) {
    std::tie(key_side_, key_up_) = across(key_light);
    for (const Exhibit& exhibit : exhibits_) rays_.add(exhibit.body->mesh, exhibit.kept);
    rays_.commit();
}

Vec3 Studio::key_direction(double r1, double r2) const {
    const double radius = key_radius * std::sqrt(r1), angle = 2 * pi * r2;
    return unit(key_light_ + radius * std::cos(angle) * key_side_ + radius * std::sin(angle) * key_up_);
}

/// Where the ray meets the plane of the exhibit's cut, on its way in; nothing if not within the body's bounds.
std::optional<double> Studio::cut_distance(const Exhibit& exhibit, const Ray& ray) const {
    const double slope = dot(exhibit.kept.normal, ray.direction);
    if (!exhibit.face || !(slope < 0)) return std::nullopt;
    const double t = (exhibit.kept.limit - dot(exhibit.kept.normal, ray.origin)) / slope;
    if (!(t > ray.near && t < ray.far)) return std::nullopt;
    const Vec3 p = ray.at(t);
    const auto& [low, high] = exhibit.body->bounds;
    const bool near = p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y && p.z < high.z;
    return near ? std::optional(t) : std::nullopt;
}

Studio::Surface Studio::shade_triangle(const Ray& ray, const RayHit& hit) const {
    const Body& body = *exhibits_[hit.body].body;
    const Triangle& t = body.mesh.triangles[hit.triangle];
    const auto normal_at = [&](std::size_t k) { return body.normals.at(hit.triangle, k); };
    const Vec3& a = body.mesh.vertices[t[0]];
    Vec3 facing = cross(body.mesh.vertices[t[1]] - a, body.mesh.vertices[t[2]] - a);
    const double area = norm(facing);
    facing = area > 0 ? (1 / area) * facing : -1 * ray.direction;
    Vec3 normal = (1 - hit.u - hit.v) * normal_at(0) + hit.u * normal_at(1) + hit.v * normal_at(2);
    const double length = norm(normal);
    normal = length > 0.1 ? (1 / length) * normal : facing;
    if (dot(facing, ray.direction) > 0) facing = -1 * facing, normal = -1 * normal;
    return {ray.at(hit.distance), normal, facing, body.colour, hit.distance};
}

std::optional<Studio::Surface> Studio::nearest(const Ray& ray, double pixel) const {
    std::optional<Surface> found;
    Ray rest = ray;
    if (const auto hit = rays_.nearest(ray)) {
        found = shade_triangle(ray, *hit);
        rest.far = hit->distance;
    }
    for (const Exhibit& exhibit : exhibits_) {
        const auto t = cut_distance(exhibit, rest);
        if (!t) continue;
        const auto colour = exhibit.face(ray.at(*t), pixel * *t);
        if (!colour) continue;
        found = {ray.at(*t), exhibit.kept.normal, exhibit.kept.normal, *colour, *t};
        rest.far = *t;
    }
    return found;
}

bool Studio::blocked(const Ray& ray) const {
    if (rays_.blocked(ray)) return true;
    return std::any_of(exhibits_.begin(), exhibits_.end(), [&](const Exhibit& exhibit) {
        const auto t = cut_distance(exhibit, ray);
        return t && exhibit.face(ray.at(*t), 0);
    });
}

Light Studio::illuminate(const Surface& s, const Vec3& view, const std::array<double, 4>& random) const {
    const Vec3 origin = s.point + lift * s.facing;
    double key = 0, shine = 0;
    const Vec3 to_key = key_direction(random[0], random[1]);
    const double slope = dot(s.normal, to_key);
    if (slope > 0 && dot(s.facing, to_key) > 0 && !blocked({origin, to_key})) {
        key = key_share * slope / key_light_.z;
        shine = gloss * std::pow(std::max(0.0, dot(s.normal, unit(to_key - view))), gloss_power);
    }
    Light dome;
    const Vec3 out = cosine_direction(s.normal, random[2], random[3]);
    const double below = out.z < 0 ? (floor_ - origin.z) / out.z : 1e30;  // where it meets the floor
    if (blocked({origin, out, 0, below})) {
        dome = near_light * s.colour;
    } else {
        const double value = out.z < 0 ? floor_light : sky(out);
        dome = {value, value, value};
    }
    return times(s.colour, Light{key, key, key} + (1 - key_share) * dome) + Light{shine, shine, shine};
}

/// The floor shows as paper with shadows, which fade out in the outer half of its reach.
Light Studio::trace_floor(const Ray& ray, double shadow, const std::array<double, 4>& random) const {
    if (!(ray.direction.z < 0)) return paper_light;
    const Vec3 p = ray.at((floor_ - ray.origin.z) / ray.direction.z);
    const double out = std::hypot(p.x, p.y) / reach_;
    if (!(out < 1)) return paper_light;
    constexpr Vec3 up{0, 0, 1};
    const Vec3 origin = p + lift * up;
    const double key = blocked({origin, key_direction(random[0], random[1])}) ? 0 : 1;
    const double dome = blocked({origin, cosine_direction(up, random[2], random[3])}) ? floor_near_light : 1;
    const double fade = shadow * (1 - smooth_step(2 * out - 1));
    const double light = 1 - fade * (1 - (key_share * key + (1 - key_share) * dome));
    return {light, light, light};
}

Light Studio::trace(const Ray& ray, double pixel, double shadow, const std::array<double, 4>& random) const {
    if (const auto surface = nearest(ray, pixel)) return illuminate(*surface, ray.direction, random);
    return shadow > 0 ? trace_floor(ray, shadow, random) : paper_light;
}

void draw_studio(Image& image, const PixelRect& rect, const Studio& studio, const Camera& camera, int samples,
                 const Progress& progress, std::string_view stage) {
    Stage rows(progress, stage, std::uint64_t(rect.height));
    const double edge = edge_fade * std::min(rect.width, rect.height);
    const auto draw_pixel = [&](int x, int y) {
        const Sequence sequence(x, y);
        const int to_edge = std::min({x, y, rect.width - 1 - x, rect.height - 1 - y});
        const double shadow = smooth_step(to_edge / edge);
        Light sum;
        int i = 0;
        bool empty = true;
        while (i < samples && !(empty && i == samples_to_be_empty)) {
            const auto r = sequence.at(i++);
            const Light light = studio.trace(camera.through({x + r[0], y + r[1]}), camera.pixel, shadow,
                                             {r[2], r[3], r[4], r[5]});
            empty = empty && light == paper_light;
            sum = sum + light;
        }
        set_pixel(image, rect.x + x, rect.y + y, to_srgb((1.0 / i) * sum));
    };
    for_chunks(std::uint64_t(rect.height), 4, [&](std::uint64_t, std::uint64_t begin, std::uint64_t end) {
        for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < rect.width; ++x) draw_pixel(x, y);
        rows.advance(end - begin);
    });
}

}  // namespace its::picture
