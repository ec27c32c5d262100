#include "its/query.h"

#include <nanobind/stl/optional.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "arrays.h"
#include "calls.h"
#include "module.h"
#include "shell.h"

/// Questions about points. Batches write into arrays that Python has made; single points have short cuts, since
/// there the way in costs more than the answer.
namespace its::python {

namespace {

// Batches up to these sizes take some 10 ms at most, and are not watched: sides of closed meshes and values
// take less than 100 ns; a side of an open mesh may take a sum over the whole boundary, some 100 µs.
constexpr std::uint64_t few = 1 << 17, few_open = 1 << 7;

bool is_finite(const Vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

std::optional<double> number(PyObject* object) {
    if (PyFloat_Check(object)) return PyFloat_AsDouble(object);
    return {};
}

/// A point of three Python floats, or a float64 array of shape (3,); nothing for all else.
std::optional<Vec3> single_point(nb::handle object) {
    if (PyTuple_CheckExact(object.ptr())) {
        if (PyTuple_Size(object.ptr()) != 3) return {};
        Vec3 point;
        for (int axis = 0; axis < 3; ++axis) {
            const auto value = number(PyTuple_GetItem(object.ptr(), axis));
            if (!value) return {};
            point[axis] = *value;
        }
        return point;
    }
    if (PyList_CheckExact(object.ptr())) return {};
    nb::ndarray<const double, nb::shape<3>, nb::c_contig, nb::device::cpu> array;
    if (!nb::try_cast(object, array, false)) return {};
    return Vec3{array(0), array(1), array(2)};
}

/// The code of a single point, or nothing if it is none.
nb::object classify_point(const Shell& shell, nb::handle object) {
    const std::optional<Vec3> point = single_point(object);
    if (!point) return nb::none();
    if (!is_finite(*point)) return nb::int_(int(not_finite));
    return nb::int_(int(shell.query().classify(*point)));
}

/// f at a single point, or nothing if it is none.
nb::object value_point(const Shell& shell, nb::handle object) {
    const std::optional<Vec3> point = single_point(object);
    if (!point) return nb::none();
    return nb::float_(shell.query().value(*point));
}

void classify(const Shell& shell, const Points& points, const Out<std::int8_t>& out, int threads,
              const nb::object& observer) {
    const bool open = shell.query().shell().info().sign == SignRule::generalized;
    watched_if_many({observer, threads}, points.shape(0), open ? few_open : few, [&](const Run& run) {
        shell.query().classify(points_of(points), rows_of<std::int8_t>(out), run);
    });
}

void value(const Shell& shell, const Points& points, const Out<double>& out, int threads,
           const nb::object& observer) {
    watched_if_many({observer, threads}, points.shape(0), few,
                    [&](const Run& run) { shell.query().value(points_of(points), rows_of<double>(out), run); });
}

void gradient(const Shell& shell, const Points& points, const OutRows<double, 3>& out, int threads,
              const nb::object& observer) {
    watched_if_many({observer, threads}, points.shape(0), few, [&](const Run& run) {
        shell.query().gradient(points_of(points), rows_of<Vec3>(out), run);
    });
}

void distance_bounds(const Shell& shell, const Points& points, const OutRows<double, 2>& out, int threads,
                     const nb::object& observer) {
    watched_if_many({observer, threads}, points.shape(0), few, [&](const Run& run) {
        shell.query().signed_distance_bound(points_of(points), rows_of<Interval>(out), run);
    });
}

/// Values and proven errors.
void winding_number(const Shell& shell, const Points& points, const OutRows<double, 2>& out, int threads,
                    const nb::object& observer) {
    run_watched({observer, threads}, [&](const Run& run) {
        shell.query().winding_number(points_of(points), rows_of<WindingNumber>(out), run);
    });
}

constexpr std::uint64_t block = 1 << 17;  ///< points that are searched together and kept at a time

void report(const Run& run, const char* stage, double done) {
    if (run.progress && !run.progress(stage, done)) throw Cancelled("stopped by the caller");
}

/// fn(begin, closest points) for consecutive blocks of points.
template <class F>
void for_closest(Shell& shell, std::span<const Vec3> points, const Run& run, F&& fn) {
    report(run, "search tree", 0);
    const ClosestPoints& tree = shell.closest({.threads = run.threads});
    std::vector<ClosestPoint> found(std::min<std::uint64_t>(block, points.size()));
    for (std::uint64_t begin = 0; begin < points.size(); begin += block) {
        const std::uint64_t count = std::min<std::uint64_t>(block, points.size() - begin);
        const std::span<ClosestPoint> results(found.data(), count);
        tree.find(points.subspan(begin, count), results, {.threads = run.threads});
        fn(begin, std::span<const ClosestPoint>(results));
        report(run, "closest points", double(begin + count) / double(points.size()));
    }
}

void closest(Shell& shell, const Points& points, const OutRows<double, 3>& point, const Out<double>& distance,
             const Out<std::int64_t>& face, const OutRows<double, 3>& barycentric, int threads,
             const nb::object& observer) {
    run_watched({observer, threads}, [&](const Run& run) {
        const std::span<Vec3> places = rows_of<Vec3>(point);
        const auto weights = rows_of<std::array<double, 3>>(barycentric);
        for_closest(shell, points_of(points), run,
                    [&](std::uint64_t begin, std::span<const ClosestPoint> found) {
                        for (std::uint64_t i = 0; const ClosestPoint& c : found) {
                            const std::uint64_t at = begin + i++;
                            places[at] = c.point;
                            distance.data()[at] = c.distance;
                            face.data()[at] = std::int64_t(c.triangle);  // none: −1
                            weights[at] = c.barycentric;
                        }
                    });
    });
}

/// NaN where there is no side, or it is uncertain.
double with_side(double distance, std::int8_t code) {
    switch (Side(code)) {
        case Side::inside:
            return -distance;
        case Side::on_surface:
            return 0;
        case Side::outside:
            return distance;
        default:
            return std::numeric_limits<double>::quiet_NaN();
    }
}

/// The distance with the sign of the side: exact as both are. NaN for points that are not finite.
void signed_distance(Shell& shell, const Points& points, const Out<double>& out, int threads,
                     const nb::object& observer) {
    run_watched({observer, threads}, [&](const Run& run) {
        const std::span<const Vec3> all = points_of(points);
        std::vector<std::int8_t> sides(std::min<std::uint64_t>(block, all.size()));
        for_closest(shell, all, run, [&](std::uint64_t begin, std::span<const ClosestPoint> found) {
            const std::span<std::int8_t> codes(sides.data(), found.size());
            shell.query().classify(all.subspan(begin, found.size()), codes, {.threads = run.threads});
            for (std::uint64_t i = 0; i < found.size(); ++i) {
                // A distance that is rounded to 0 keeps its sign.
                const double distance = std::max(found[i].distance, std::numeric_limits<double>::denorm_min());
                out.data()[begin + i] = with_side(distance, codes[i]);
            }
        });
    });
}

}  // namespace

void bind_query(nb::module_& module) {
    auto shell = nb::borrow<nb::class_<Shell>>(module.attr("Shell"));
    const auto points = nb::arg("points"), out = nb::arg("out"), threads = nb::arg("threads");
    const auto observer = nb::arg("observer").none();
    shell.def("classify_point", classify_point, nb::arg("point").none(),
              nb::sig("def classify_point(self, point: object, /) -> int | None"));
    shell.def("value_point", value_point, nb::arg("point").none(),
              nb::sig("def value_point(self, point: object, /) -> float | None"));
    shell.def("classify", classify, points, out, threads, observer,
              nb::sig("def classify(self, points: numpy.typing.NDArray[numpy.float64], out: "
                      "numpy.typing.NDArray[numpy.int8], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> None"));
    shell.def("value", value, points, out, threads, observer,
              nb::sig("def value(self, points: numpy.typing.NDArray[numpy.float64], out: "
                      "numpy.typing.NDArray[numpy.float64], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> None"));
    shell.def("gradient", gradient, points, out, threads, observer,
              nb::sig("def gradient(self, points: numpy.typing.NDArray[numpy.float64], out: "
                      "numpy.typing.NDArray[numpy.float64], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> None"));
    shell.def("distance_bounds", distance_bounds, points, out, threads, observer,
              nb::sig("def distance_bounds(self, points: numpy.typing.NDArray[numpy.float64], out: "
                      "numpy.typing.NDArray[numpy.float64], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> None"));
    shell.def("winding_number", winding_number, points, out, threads, observer,
              nb::sig("def winding_number(self, points: numpy.typing.NDArray[numpy.float64], "
                      "out: numpy.typing.NDArray[numpy.float64], threads: int, "
                      "observer: collections.abc.Callable[[str, float], bool] | None) -> None"));
    shell.def("closest", closest, points, nb::arg("point"), nb::arg("distance"), nb::arg("face"),
              nb::arg("barycentric"), threads, observer,
              nb::sig("def closest(self, points: numpy.typing.NDArray[numpy.float64], point: "
                      "numpy.typing.NDArray[numpy.float64], distance: numpy.typing.NDArray[numpy.float64], "
                      "face: numpy.typing.NDArray[numpy.int64], barycentric: "
                      "numpy.typing.NDArray[numpy.float64], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> None"));
    shell.def("signed_distance", signed_distance, points, out, threads, observer,
              nb::sig("def signed_distance(self, points: numpy.typing.NDArray[numpy.float64], out: "
                      "numpy.typing.NDArray[numpy.float64], threads: int, observer: "
                      "collections.abc.Callable[[str, float], bool] | None) -> None"));
}

}  // namespace its::python
