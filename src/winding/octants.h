#pragma once

#include <cstdint>
#include <vector>

#include "winding/filling.h"

namespace its::winding {

/// The winding number of a Filling in the eight cubes that halve a cube, all eight at once in vector code: a
/// *lane* is one of them. What is far from a lane's cube is a quadratic function there; the triangles of what
/// is near are kept, for its points and for the cubes that halve it. See docs/design/signs.md.
class Octants {
public:
    static constexpr int lanes = 8;
    struct Cubes {
        double x[lanes], y[lanes], z[lanes];  ///< centres
        double half;                          ///< of their side
    };

    /// All of space, as lane 0, nothing expanded.
    explicit Octants(const Filling& filling);

    /// \param from  a lane of it holds `cubes`
    /// \param tolerance  parts of F are expanded where the error of that is smaller than this; > 0
    /// \param detail  patches of smaller radius are left whole: for narrowing further, not for at()
    void narrow(const Octants& from, int lane, const Cubes& cubes, double tolerance, double detail);

    WindingEstimate at_centre(int lane) const;
    /// |w(q) − w(centre)| for all points q of the cube, but for whole numbers where the way crosses F.
    double variation(int lane) const;
    /// The winding number as a quadratic function, w(centre + b) = value + gradient·b + ½ b·hessian b, within
    /// `error` at all points of the cube, but for whole numbers where the way crosses F.
    struct Quadratic {
        double value, gradient[3], hessian[6];  ///< xx, yy, zz, xy, xz, yz
        double error;
    };
    Quadratic quadratic(int lane) const;
    /// Whether F stays away from the cube, so that variation() holds without exception.
    bool clear(int lane) const { return (clear_ >> lane & 1) != 0; }

    static constexpr int block = 28;  ///< points taken at once: a cube's 27
    struct Points {
        double x[block], y[block], z[block];
    };
    struct Estimates {
        double value[block], error[block];
    };
    /// At points of the lane's cube. The error is infinite, or nearly, where a point is in F but for rounding.
    void at(int lane, const Points& points, Estimates& out);

private:
    using Mask = std::uint32_t;  ///< a bit for each lane
    using Row = double[lanes];

    struct Part {
        std::uint32_t node;
        std::uint32_t up;  ///< the triangle of triangles_ at its chord; none: it has none
        Mask mask;         ///< where it is near
    };
    struct Near : Part {
        std::uint32_t corner[3];  ///< ends[0], middle, ends[1], in vertices_
        std::uint32_t chord[3];   ///< between the ends, and along the halves, in chords_
        bool turned = false;      ///< chord[0] is from ends[1] to ends[0]: the second half of a loop
    };
    /// A vertex as seen from the centres.
    struct Sights {
        Row x, y, z, length;
    };
    /// A triangle's side from vertex a to vertex b. Of its triangles, those that are far count in `far`, the
    /// others in `near`, −1 where they have it the other way.
    struct Chord {
        std::uint32_t a, b;
        Row slope, remainder, far, near;
    };
    struct Expansion {
        Row value, gradient[3], hessian[6];  ///< xx, yy, zz, xy, xz, yz
        Row error;
    };
    /// Bound on the error of an expansion: a cubic polynomial in the distance from its centre over its radius.
    struct Error {
        Vec3 centre;
        double inverse;  ///< of the radius
        double coefficient[4];
    };
    struct Errors {
        Row constant, linear, quadratic, cubic;
    };
    /// A vertex as seen from a block of points.
    struct Seen {
        double x[block], y[block], z[block], length[block];
    };

    void start(const Octants& from, int lane, const Cubes& cubes);
    std::uint32_t triangle(std::uint32_t index, std::uint32_t up, Mask mask);
    void patch(std::uint32_t index, std::uint32_t up, Mask mask);
    void finish();
    std::uint32_t add_vertex(const Vec3& v);
    std::uint32_t add_chord(std::uint32_t a, std::uint32_t b);
    Error own_error(int lane) const;
    double far_error(int lane, double radius) const;
    double linear(const Expansion& e, int lane) const;
    double bend(const Expansion& e, int lane) const;
    double rounding(int lane) const;

    // Vector code over lanes.
    void see(const Vec3& v, Sights& out) const;
    void distances(const Vec3& centre, Row& out) const;
    void measure(const Vec3& d, const Sights& a, const Sights& b, Chord& chord) const;
    void meet(const Near& t, Row& out) const;
    void classify(const Near& t, const Row& meets, const Row& member, Row& far) const;
    void add_angles(const Near& t, const Row& far, const Row& near);
    static void weigh(Chord& chord, double sign, const Row& far, const Row& near);
    void expand(const Chord& chord);
    void far_errors(const Filling::Node& node, const Row& length, Row& scale, Row& out) const;
    void add_far(const Filling::Node& node, const Row& length, Mask mask, Expansion& to) const;
    void add_errors(const Filling::Node& node, const Row& scale, const Row& error, Mask mask);

    // Vector code over points.
    static void see(const Vec3& v, const Points& points, Seen& out);
    static void add(const Seen& a, const Seen& b, const Seen& c, AngleSums<block>& sums, double* doubtful);
    static void add_sums(const AngleSums<block>& sums, double* value);
    static void add_error(const Error& e, const Points& points, double* error);
    void far_values(int lane, const Points& points, double* value) const;

    const Filling* filling_;
    double tolerance_ = 0, detail_ = 0;
    Cubes cubes_ = {};
    double radius_ = 0;          ///< of balls that hold the cubes
    Expansion far_ = {};         ///< of what is far
    Expansion all_ = {};         ///< of all of F, but for the values of near triangles; error: of what is near
    Row whole_ = {};             ///< errors of patches left whole, in all_
    Errors own_ = {};            ///< of what is far from these cubes, but not from larger ones
    std::vector<Error> errors_;  ///< of what was far from those
    AngleSums<lanes> far_angles_, angles_;  ///< of far triangles and of near ones, at the centres
    double count_ = 0;                      ///< of both
    Row doubtful_ = {};
    Mask clear_ = 0;
    std::vector<Near> triangles_;  ///< each after the one at its chord
    std::vector<Part> patches_;
    std::vector<Vec3> vertices_;
    std::vector<Sights> sights_;
    std::vector<Chord> chords_;
    std::vector<std::uint32_t> place_;  ///< of something in another list
    std::vector<Seen> seen_;
};

}  // namespace its::winding
