#pragma once

#include <cstdint>
#include <string>

#include "common.h"
#include "its/mesh.h"

/// Lengths on the command line.
namespace its::cli {

/// An option whose value is a length: in mesh units, or with % of the longest side.
class LengthOption {
public:
    enum class Range : std::uint8_t {
        not_negative,  ///< 0 is as if the option were not given
        positive,
        any,  ///< negative ones, too
    };
    CLI::Option* declare(CLI::App& app, const std::string& option, const std::string& description,
                         Range range = Range::not_negative);
    CLI::Option* declare(CLI::App& app, const std::string& option, const std::string& description,
                         bool positive) {
        return declare(app, option, description, positive ? Range::positive : Range::not_negative);
    }
    bool given() const { return value_ != 0; }
    /// In mesh units; percentages are of the longest side of this mesh.
    double length(const Mesh& mesh) const;

private:
    double value_ = 0;
    bool percent_ = false;
};

}  // namespace its::cli
