#pragma once

#include <string>

#include "common.h"
#include "its/weld.h"
#include "length.h"
#include "report.h"

/// The option --weld LENGTH of commands that read a mesh.
namespace its::cli {

class WeldOption {
public:
    void declare(CLI::App& app);
    bool given() const { return length_.given(); }
    /// In mesh units; percentages are of the longest side of this mesh.
    double length(const Mesh& mesh) const { return length_.length(mesh); }

private:
    LengthOption length_;
};

Json weld_json(const WeldReport& report);
/// "12 corners nearer than 0.1 became 5; …"
std::string weld_text(const WeldReport& report);

}  // namespace its::cli
