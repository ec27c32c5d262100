#include <nanobind/stl/optional.h>

#include "arrays.h"
#include "calls.h"
#include "its/distance.h"
#include "its/inspect.h"
#include "its/weld.h"
#include "module.h"
#include "options.h"

/// What needs no shell: reports, welding, measured distances.
namespace its::python {

namespace {

nb::dict dict_of(const WrongPart& part) {
    nb::dict dict;
    dict["fault"] = text(name(part.fault));
    dict["triangles"] = part.triangles;
    dict["first_triangle"] = part.first_triangle;
    dict["bounds"] = tuple_of(part.bounds);
    dict["volume"] = part.volume;
    dict["depth"] = part.depth;
    dict["overlaps"] = part.overlaps;
    return dict;
}

nb::dict dict_of(const PartsReport& parts) {
    nb::dict dict;
    nb::list wrong;
    for (const WrongPart& part : parts.wrong) wrong.append(dict_of(part));
    dict["closed"] = parts.closed;
    dict["nested"] = parts.nested;
    dict["overlapping"] = parts.overlapping;
    dict["to_turn"] = parts.to_turn;
    dict["wrong"] = wrong;
    return dict;
}

nb::dict dict_of(const MeshReport& report) {
    nb::dict dict;
    dict["vertices"] = report.vertices;
    dict["triangles"] = report.triangles;
    dict["degenerate"] = report.degenerate;
    dict["duplicate"] = report.duplicate;
    dict["boundary_edges"] = report.boundary_edges;
    dict["nonmanifold_edges"] = report.nonmanifold_edges;
    dict["inconsistent_edges"] = report.inconsistent_edges;
    dict["unbalanced_edges"] = report.unbalanced_edges;
    dict["odd_edges"] = report.odd_edges;
    dict["open_edges"] = report.open_edges;
    dict["open_odd_edges"] = report.open_odd_edges;
    dict["t_junctions"] = report.t_junctions;
    dict["components"] = report.components;
    dict["euler"] = report.euler;
    dict["closed"] = report.closed;
    dict["oriented"] = report.oriented;
    dict["bounds"] = tuple_of(report.bounds);
    dict["signed_volume"] = report.signed_volume;
    dict["sign"] = text(name(report.sign));
    dict["sign_reason"] = report.sign_reason;
    dict["sign_advice"] = text(name(report.sign_advice));
    dict["turned"] = report.turned;
    dict["repaired"] = report.repaired;
    dict["separating"] = report.separating;
    dict["parts"] = dict_of(report.parts);
    return dict;
}

nb::dict check(const AnyArray& vertices, const std::optional<AnyArray>& faces, int threads,
               const nb::object& observer) {
    const MeshView mesh = mesh_view(vertices, faces);
    return dict_of(watched({observer, threads}, [&](const Run& run) { return inspect(mesh, run); }));
}

nb::tuple weld_mesh(const AnyArray& vertices, const std::optional<AnyArray>& faces, double length) {
    const MeshView mesh = mesh_view(vertices, faces);
    Welded welded = watched({nb::none()}, [&](const Run&) { return weld(mesh, length); });
    nb::dict report;
    report["length"] = welded.report.length;
    report["corners"] = welded.report.corners;
    report["clusters"] = welded.report.clusters;
    report["degenerate"] = welded.report.degenerate;
    report["largest_move"] = welded.report.largest_move;
    return nb::make_tuple(arrays_of(std::move(welded.mesh)), report);
}

nb::tuple measure(const AnyArray& vertices, const std::optional<AnyArray>& faces, const AnyArray& to_vertices,
                  const std::optional<AnyArray>& to_faces, std::uint64_t samples, int threads,
                  const nb::object& observer) {
    const MeshView from = mesh_view(vertices, faces), to = mesh_view(to_vertices, to_faces);
    const MeshDistance distance =
        watched({observer, threads}, [&](const Run& run) { return mesh_distance(from, to, samples, run); });
    return nb::make_tuple(distance.max, distance.mean, distance.root_mean_square);
}

}  // namespace

void bind_meshes(nb::module_& module) {
    module.def("check", check, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("threads"),
               nb::arg("observer").none(),
               nb::sig("def check(vertices: numpy.typing.NDArray[typing.Any], faces: "
                       "numpy.typing.NDArray[typing.Any] | None, threads: int, observer: "
                       "collections.abc.Callable[[str, float], bool] | None) -> dict[str, typing.Any]"));
    module.def("weld", weld_mesh, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("length"),
               nb::sig("def weld(vertices: numpy.typing.NDArray[typing.Any], faces: "
                       "numpy.typing.NDArray[typing.Any] | None, length: float) -> "
                       "tuple[tuple[numpy.typing.NDArray[numpy.float64], "
                       "numpy.typing.NDArray[numpy.uint32]], dict[str, typing.Any]]"));
    module.def("mesh_distance", measure, nb::arg("vertices"), nb::arg("faces").none(), nb::arg("to_vertices"),
               nb::arg("to_faces").none(), nb::arg("samples"), nb::arg("threads"), nb::arg("observer").none(),
               nb::sig("def mesh_distance(vertices: numpy.typing.NDArray[typing.Any], faces: "
                       "numpy.typing.NDArray[typing.Any] | None, to_vertices: "
                       "numpy.typing.NDArray[typing.Any], to_faces: numpy.typing.NDArray[typing.Any] | "
                       "None, samples: int, threads: int, observer: collections.abc.Callable[[str, float], "
                       "bool] | None) -> tuple[float, float, float]"));
}

}  // namespace its::python
