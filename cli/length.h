#pragma once

#include <string>

#include "common.h"
#include "its/mesh.h"

/// Lengths on the command line.
namespace its::cli {

/// An option whose value is a length: in mesh units, or with % of the longest side.
class LengthOption {
public:
    /// \param positive  0 is refused; else it is as if the option were not given
    CLI::Option* declare(CLI::App& app, const std::string& option, const std::string& description,
                         bool positive = false);
    bool given() const { return value_ > 0; }
    /// In mesh units; percentages are of the longest side of this mesh.
    double length(const Mesh& mesh) const;

private:
    double value_ = 0;
    bool percent_ = false;
};

}  // namespace its::cli
