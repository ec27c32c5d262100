#include <gtest/gtest.h>

#include <initializer_list>
#include <set>
#include <string>

#include "its/distance.h"
#include "its/inspect.h"
#include "its/mesh.h"
#include "its/query.h"
#include "its/shell.h"
#include "its/shell_file.h"
#include "its/simplify.h"
#include "its/surface.h"

namespace its {
namespace {

/// Each value has a name of its own, which reads back, and nothing else does.
template <class Value, class Parse>
void expect_names(std::initializer_list<Value> values, const Parse& parse) {
    std::set<std::string_view> names;
    for (const Value value : values) {
        EXPECT_TRUE(names.insert(name(value)).second) << name(value);
        EXPECT_EQ(parse(name(value)), value);
        EXPECT_FALSE(parse(std::string(name(value)) + "x"));
    }
    EXPECT_FALSE(parse(""));
    EXPECT_FALSE(parse("unknown"));
    EXPECT_EQ(name(Value(101)), "unknown");
}

TEST(Names, OfAllEnumsReadBack) {
    expect_names({SignRule::winding, SignRule::generalized, SignRule::unsigned_rule, SignRule::even_odd},
                 parse_sign_rule);
    expect_names({SignAdvice::none, SignAdvice::around_both_sides, SignAdvice::with_holes_open,
                  SignAdvice::winding_as_it_is, SignAdvice::crossings_as_it_is,
                  SignAdvice::generalized_as_it_is, SignAdvice::fill_nevertheless},
                 parse_sign_advice);
    expect_names({Extrema::certified, Extrema::candidates}, parse_extrema);
    expect_names({Solver::direct, Solver::lscg}, parse_solver);
    expect_names({LoadCheck::full, LoadCheck::quick}, parse_load_check);
    expect_names(
        {SimplifyMethod::certified, SimplifyMethod::vertex, SimplifyMethod::priority, SimplifyMethod::qem},
        parse_simplify_method);
    expect_names({SimplifyStop::faces_reached, SimplifyStop::tolerance_reached, SimplifyStop::shell_reached,
                  SimplifyStop::topology_reached},
                 parse_simplify_stop);
    expect_names({SurfaceSide::outer, SurfaceSide::inner, SurfaceSide::zero}, parse_surface_side);
    expect_names({Side::inside, Side::on_surface, Side::outside}, parse_side);
    expect_names({ShellSide::inside, ShellSide::on_shell, ShellSide::outside}, parse_shell_side);
    expect_names({NumberType::float32, NumberType::float64, NumberType::int16, NumberType::uint16,
                  NumberType::int32, NumberType::uint32, NumberType::int64, NumberType::uint64},
                 parse_number_type);
}

TEST(Names, AdviceIsARule) {
    EXPECT_EQ(advised_rule(SignAdvice::none), std::nullopt);
    EXPECT_EQ(advised_rule(SignAdvice::with_holes_open), SignRule::unsigned_rule);
    EXPECT_EQ(advised_rule(SignAdvice::winding_as_it_is), SignRule::winding);
    EXPECT_EQ(advised_rule(SignAdvice::crossings_as_it_is), SignRule::even_odd);
    EXPECT_EQ(advised_rule(SignAdvice::fill_nevertheless), SignRule::generalized);
}

}  // namespace
}  // namespace its
